#pragma once

#include <vector>

#include "vest_tissue/fem/tissue.h"

/// Cutting of tetrahedra (a knot P becomes P and P'): a blade opens faces between elements, and a knot
/// whose elements no longer hold together around it by closed faces is doubled. No element is lost or made,
/// so that mass, rest shape and stiffness of every element stay (docs/decisions/0019-…).
namespace vest::fem {

inline constexpr std::size_t kMostIncident =
    192;  ///< elements at one knot that dividing has room for (assumed)

/// Faces behind which there is tissue: element·4 + face.
inline std::uint32_t faceCode(std::uint32_t element, int face) {
  return 4 * element + static_cast<std::uint32_t>(face);
}
/// Knots of a face as they are now, counter-clockwise from outside the element.
std::array<Index, 3> faceKnots(const TissueState& state, std::uint32_t code);

/// Opens a face on both of its sides. False: it was open, or is the boundary.
bool openFace(const TissueModel& model, TissueState& state, std::uint32_t code);

struct Doubling {
  Index original = 0, copy = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< from the original's elements to the copy's, no unit
};
/// Divides the listed knots where open faces separate their elements; masses are shared out by elements. Each
/// part but that with the smallest element gets a copy. Stops, and returns false, where the state's reserved
/// room or that of `out` is used up: the rest of that knot stays whole. Allocates nothing.
bool divideKnots(const TissueModel& model, TissueState& state, const std::vector<Index>& knots,
                 std::vector<Doubling>& out);

/// Number of parts that hold together by closed faces. `root` has room for one entry per element.
std::uint32_t tissueParts(const TissueModel& model, const TissueState& state,
                          std::vector<std::uint32_t>& root);

/// What is not as it was built solves with a factor of its mesh from then on: cut, clipped or denatured.
void useFactor(TissueState& state);

/// The object as it is now, at rest shape: what a fresh model of the cut mesh is built from. Allocates.
Description cutDescription(const TissueModel& model, const TissueState& state);

}  // namespace vest::fem

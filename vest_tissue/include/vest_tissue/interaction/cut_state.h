#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/net/elements.h"

/// Cutting (a knot P becomes P and P'): what of it is State, and what of it never changes.
///
/// The blade's swept surface crosses edges of an object's contact triangles. A triangle that it has crossed
/// on two edges is cut through: the knots nearest to the crossings become part of the cut line, and a knot
/// whose triangles the line divides is doubled. Knots stay where they are, so that mass, rest shape and step
/// bound are kept and no sliver arises; the skin, which is finer, opens along the blade's own track
/// (docs/decisions/0019-…).
namespace vest::interaction {

using Vector3Floats = std::array<float, 3>;

/// Edge `edge` (corner edge -> corner edge + 1) of a contact triangle that a blade has crossed, until the
/// triangle is cut through.
struct CutCrossing {
  std::uint32_t triangle = 0;
  std::uint8_t edge = 0;
  float place = 0;        ///< on the edge, 0 … 1
  std::uint8_t knot = 3;  ///< which corner stands for it in the line, where a neighbour has decided; 3: open
};

/// Track of the blade through a contact triangle, at rest.
struct CutTrack {
  std::uint32_t triangle = 0;
  std::array<std::uint32_t, 2> knots{};  ///< of the cut line that stand for its ends
  Vector3Floats from{}, to{};            ///< m
  std::uint8_t settled = 0;              ///< 1: the skin on its far side has found its home
};

/// Two triangles of the cut's face along one edge of the skin, or one of the inner wall below a skin
/// triangle.
struct CutFace {
  std::uint32_t skin_triangle = 0;
  std::uint8_t edge = 3;                 ///< 3: inner wall
  std::array<std::uint32_t, 2> built{};  ///< skin triangles; the inner wall has one, twice
};

/// Per object.
struct CutState {
  std::vector<CutCrossing> crossings;
  std::vector<CutTrack> tracks;
  std::vector<std::uint8_t> line;     ///< per contact triangle: bit per edge that lies in the cut line
  std::vector<Vector3Floats> inward;  ///< per knot: away from the cut into its part, at rest; 0: no cut near
  std::vector<std::uint32_t> home;  ///< per skin triangle: contact triangle that it lies on; kNone: of a cut
  std::vector<std::uint8_t> open;   ///< per skin triangle: bit per edge that has had no neighbour ever
  std::vector<std::uint32_t> lies_on;  ///< per skin vertex: contact triangle that it hangs on after a cut
  std::vector<Vector3Floats> rest;     ///< per skin vertex, m: where it is at rest
  std::vector<std::uint8_t> free;      ///< per skin vertex: kFree, kWaits
  std::vector<std::uint32_t> outer, inner, wall;  ///< per skin vertex: its doubles in cut face and inner wall
  std::vector<CutFace> faces;
  std::uint32_t parts = 1;         ///< connected pieces
  double area = 0.0;               ///< m², cut so far
  double energy = 0.0;             ///< J
  std::vector<net::Volume> spare;  ///< room for the volumes of parts, empty; not hashed
  bool opened = false;             ///< the enclosed volume leaks: no pressure any more
  bool unfinished = false;         ///< inner wall still to be built, or skin to be bound or taken away
  bool exhausted = false;          ///< no room for more: the cut stays incomplete (degraded)
};
inline constexpr std::uint32_t kNone = 0xffffffffu;
inline constexpr std::uint8_t kFree = 1;   ///< bound by `rest` and `lies_on`, not as the scene says
inline constexpr std::uint8_t kWaits = 2;  ///< for its binding: the delta had no room, the next step has

/// Per instrument.
struct CuttingTool {
  double owed = 0.0;    ///< J: work that the blade still has to do for what it has cut
  double force = 0.0;   ///< N, against the blade's motion, last step
  double torque = 0.0;  ///< N·m, against the jaws' closing, last step
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m: of the last cut
  std::uint16_t object = 0;
  std::uint32_t element = 0;  ///< contact triangle
};
struct CuttingState {
  std::array<CuttingTool, tools::kInstrumentCount> tools{};
};

inline constexpr std::size_t kMostCutVolumes =
    4;  ///< parts that keep an enclosed volume of their own (assumed)

/// Per object, never changes.
struct CutConstants {
  bool possible = false;   ///< a net with a surface
  bool hollow = false;     ///< its wall is thinner than the organ: one sees inside
  double wall = 0.0;       ///< m: depth of tissue under the surface that a cut divides
  double toughness = 0.0;  ///< J/m²
  double skin_edge = 0.0;  ///< m, mean edge of the skin at rest
  std::size_t most_vertices = 0, most_triangles = 0;  ///< of the skin, with all cuts
  std::vector<std::uint32_t> opposite;  ///< per contact triangle: the one across the organ, kNone
};

}  // namespace vest::interaction

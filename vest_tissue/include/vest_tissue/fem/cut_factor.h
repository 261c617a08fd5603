#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/tissue.h"

namespace vest::fem {

/// Knots of the points of one step that have room.
inline constexpr std::size_t kMostTouched = 3 * kMostTissuePoints;

/// Factor of A = (1 + h a) M + h (h + b) K of the mesh at rest, made again after each cut: in the order
/// of the whole object's, each copy right behind its origin. A cut only takes couplings away, so that the
/// factor fills no more than where knots have copies; the work is that of the whole object's factor.
/// Parts of an elastostatic object that are held stay in equilibrium: theirs is A = h² K. What a cut frees
/// has no equilibrium, and gets inertia. Where h² K is singular to rounding, the whole object gets it. Its
/// numbers are a function of the mesh alone: the same after a restore. For a corotational object it is turned
/// with the elements as the whole one's is.
class CutFactor {
 public:
  /// Sized once for objects of so many knots. What no cut has used yet takes no memory.
  CutFactor(const TissueModel& model, std::size_t knots);
  /// The state is another one: everything is found anew.
  void forget() { made_for_ = 0; }
  /// Follows the mesh. False: no room, or a matrix that is singular to rounding.
  bool renew(const TissueModel& model, const TissueState& state);
  /// A knot of a part in equilibrium. Renewed before.
  bool still(Index knot) const { return still_[knot] != 0; }
  /// m/N: greatest eigenvalue of K^-1 of the parts in equilibrium; 0 without any. Renewed before, and
  /// true.
  double softest(const TissueModel& model, const TissueState& state);
  /// x = A^-1 b per knot; held knots get 0. Renewed before. b and x may be turned (see above).
  void solve(const TissueState& state, const std::vector<Eigen::Vector3d>& b,
             std::vector<Eigen::Vector3d>& x);

  /// Finds the columns of A^-1 of these knots (repeats allowed). They are kept until the mesh changes.
  /// Renewed before. False: no room.
  bool touch(const Index* knots, std::size_t count);
  /// Block (A^-1)_ab between touched knots, 1/kg; 0 where one is held.
  Eigen::Matrix3d answer(Index a, Index b) const;
  std::uint64_t made() const { return made_; }  ///< times that a factor was made

 private:
  void findStill(const TissueModel& model, const TissueState& state);
  bool factorise(const TissueModel& model, const TissueState& state);

  std::uint64_t made_for_ = 0;  ///< 1 + revision of its mesh; 0: none
  bool usable_ = false;
  std::uint64_t made_ = 0;
  BlockLdlt factor_;
  std::vector<Index> order_;                   ///< free nodes as the whole factor has them
  std::vector<std::uint32_t> place_, copies_;  ///< per row; per node: knots
  std::vector<std::int32_t> row_of_;           ///< per knot; -1: held
  std::vector<std::uint8_t> still_;            ///< per knot
  std::vector<Index> root_;                    ///< scratch, per knot: of its part
  std::vector<std::array<Index, 2>> held_;     ///< scratch, per root: two held knots of the part
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
  Eigen::VectorXd work_;
  std::size_t touched_ = 0;               ///< in use
  std::vector<std::int32_t> touched_of_;  ///< per knot: columns; -1: none
  Eigen::MatrixXd columns_;               ///< of A^-1, three per touched knot
};

}  // namespace vest::fem

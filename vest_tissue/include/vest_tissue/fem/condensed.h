#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/model.h"

namespace vest::fem {

/// Which nodes are outer ones: those that can be touched, held, seen. Inner ones follow.
enum class Outer : std::uint8_t {
  Surface = 0,  ///< free nodes of the boundary faces
  Deep = 1,     ///< and the nodes of elements that touch the surface: cuts from outside need no factor
  All = 2       ///< every free node: nor do cuts anywhere
};

struct CondensedOptions {
  Outer outer = Outer::Surface;
  std::string cache_directory;  ///< where the inverse is kept between runs; empty: nowhere
  int most_rank = 240;          ///< columns of low-rank updates that a state has room for
};

/// Fast elastostatics (FFEM), small strain. Holds C = (K^-1)_oo, the outer block of the
/// inverse, which is the inverse of the condensed matrix K_oo - K_oi K_ii^-1 K_io. Unknowns of C: 3·(outer
/// number) + axis. Immutable but for the factor of K, which is made when first needed.
class CondensedModel {
 public:
  /// @throws std::invalid_argument as validate(Use::Static)
  CondensedModel(const Description& description, const CondensedOptions& options);

  const Description& description() const { return model_->description; }
  const Model& model() const { return *model_; }
  Eigen::Index unknowns() const { return inverse_.rows(); }
  Eigen::Index surfaceUnknowns() const { return surface_unknowns_; }          ///< the surface's come first
  const std::vector<Index>& outerNodes() const { return outer_node_; }        ///< outer number -> node
  std::int32_t outerNumber(Index node) const { return outer_number_[node]; }  ///< -1: held, inner or unused
  const Eigen::MatrixXd& inverse() const { return inverse_; }                 ///< m/N, symmetric
  /// Per element, the elements behind its faces; kNoSlot: none.
  const std::vector<std::array<std::uint32_t, 4>>& neighbours() const { return neighbours_; }
  bool fromCache() const { return from_cache_; }
  int mostRank() const { return most_rank_; }

  /// K^-1 times columns of full size (3·free nodes); factors K at the first call. Not real-time safe.
  void solveFull(Eigen::MatrixXd& columns) const;

 private:
  std::unique_ptr<const Model> model_;
  std::vector<Index> outer_node_;
  std::vector<std::int32_t> outer_number_;
  std::vector<std::array<std::uint32_t, 4>> neighbours_;
  Eigen::MatrixXd inverse_;
  Eigen::Index surface_unknowns_ = 0;
  int most_rank_ = 0;
  bool from_cache_ = false;
  mutable std::mutex mutex_;
  mutable std::unique_ptr<BlockLdlt> factor_;
};

/// One column U of the low-rank update K' = K + sum sign U U^T.
struct UpdateColumn {
  std::array<std::uint32_t, 12> row{};  ///< of the full unknowns: 3·block row + axis; kNoSlot: held
  std::array<double, 12> value{};
  double sign = -1.0;
  std::int32_t full = -1;  ///< index into CondensedState::full_columns; -1: outer rows are enough
};

/// What evolves: cuts. A copy is a snapshot. Sized for most_rank at the start.
struct CondensedState {
  explicit CondensedState(const CondensedModel& model);
  std::vector<std::uint8_t> alive;  ///< per element
  std::vector<std::uint8_t> loose;  ///< per node: belongs to a part that is cut off; its answers mean nothing
  std::vector<std::uint8_t> grounded;  ///< per node: held by an artificial spring since it came loose
  std::vector<UpdateColumn> columns;   ///< U
  Eigen::MatrixXd outer_columns;       ///< T = K^-1 U, outer rows; first columns.size() columns are in use
  std::vector<Eigen::VectorXd> full_columns;  ///< T of columns that touch inner nodes, all rows
  Eigen::MatrixXd core;                       ///< (Sigma^-1 + U^T K^-1 U)^-1
  std::uint32_t revision = 0;
};

struct CutReport {
  bool done = false;       ///< false: more rank than the state has room for, or singular; nothing changed
  int rank = 0;            ///< columns in use afterwards
  bool hanging = false;    ///< a part hangs by a node or an edge alone: held by weak artificial springs
  bool separated = false;  ///< a part came loose: see `loose_nodes`
  std::vector<Index> loose_nodes;  ///< nodes of parts that nothing fixed holds any more, ascending
};

/// Removes elements (indices; dead ones are skipped) by Woodbury's formula: six columns each. A part that no
/// longer hangs on anything fixed is taken out of the answer (docs/decisions/0017-…) and reported; it has to
/// go on as a dynamic object (looseParts()). Elements whose free nodes are all outer ones need no factor.
/// @throws std::invalid_argument for an element that does not exist
CutReport cut(const CondensedModel& model, CondensedState& state, const std::vector<std::size_t>& elements);

/// The parts that came loose, each an object of its own with nothing fixed, for backward Euler.
struct LoosePart {
  Description description;
  std::vector<Index> node;  ///< per node of the part: node of the original
};
std::vector<LoosePart> looseParts(const CondensedModel& model, const CondensedState& state);

/// Forces on outer unknowns; only these columns are used.
struct SparseLoad {
  std::vector<std::uint32_t> unknown;  ///< of C; repeats add up
  std::vector<double> force;           ///< N
};

/// Room for respond() and prescribe(), sized once.
struct CondensedScratch {
  explicit CondensedScratch(const CondensedModel& model);
  Eigen::VectorXd small, small2;
};

/// u += C' f (C': C after cuts), m, for as many of the first outer unknowns as u has: unknowns(), or
/// surfaceUnknowns() for what is seen. Loads may be on any outer unknown. Real-time safe.
void addResponse(const CondensedModel& model, const CondensedState& state, const SparseLoad& load,
                 CondensedScratch& scratch, Eigen::VectorXd& u);

/// Entry of C'. Block (outer a, outer b), 3×3, m/N. Real-time safe.
Eigen::Matrix3d complianceBlock(const CondensedModel& model, const CondensedState& state,
                                std::uint32_t outer_a, std::uint32_t outer_b);

/// Forces that bring the given outer unknowns to given displacements, on top of what `u` has already:
/// C'_pp f = target - u_p, by Cholesky. False: the unknowns are repeated or loose. At most
/// load.unknown.size() = 128.
bool prescribe(const CondensedModel& model, const CondensedState& state, const std::vector<double>& target,
               const Eigen::VectorXd& u, CondensedScratch& scratch, SparseLoad& load);

/// Displacements of all nodes, m, from forces on outer unknowns. Not real-time safe, no cuts: for checks and
/// pictures.
std::vector<Eigen::Vector3d> fullField(const CondensedModel& model, const SparseLoad& load);

}  // namespace vest::fem

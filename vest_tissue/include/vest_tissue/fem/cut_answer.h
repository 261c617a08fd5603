#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/tissue.h"

namespace vest::fem {

inline constexpr std::size_t kMostCutKnots = 128;  ///< doubled knots and their copies that have room (tuned)
/// Knots of the points of one step that have room.
inline constexpr std::size_t kMostTouched = 3 * kMostTissuePoints;

/// Low-rank update of the factor of the whole object for its cut mesh, at rest: an answer of the matrix
/// A = (1 + h a) M + h (h + b) K of the cut object for two solves with the factor F^-1 of the whole one.
///
/// Nodes that a cut has doubled are taken out of F (a constraint: their columns of F are kept), the rest of
/// the matrix is the same before and after the cut; the doubled knots and copies themselves are a small dense
/// Schur complement. With I the other nodes, G the doubled nodes, C their knots and copies:
///   A_II^-1 b = F b - F_:G (F_GG)^-1 (F b)_G,   S = A_CC - A_CI A_II^-1 A_IC,
///   x_C = S^-1 (b_C - A_CI A_II^-1 b_I),   x_I = A_II^-1 (b_I - A_IC x_C).
/// Exact but for rounding where the strain is small; for a corotational object it is turned with the elements
/// as the factor is. Its numbers are a function of the mesh alone: the same after a restore.
class CutAnswer {
 public:
  /// Sized once for objects of so many knots.
  CutAnswer(const TissueModel& model, std::size_t knots);
  /// The state is another one: everything is found anew.
  void forget() { revision_ = 0; }
  /// Follows the mesh. False: no room for so long a cut, or a matrix that is singular to rounding. Work:
  /// three solves per newly doubled node and per changed knot, eight at a time, and a dense factor of the
  /// knots.
  bool renew(const TissueModel& model, const TissueState& state, BlockLdlt& factor);
  /// x = A^-1 b per knot; held knots get 0. Renewed before. b and x may be turned (see above).
  void solve(const TissueModel& model, const TissueState& state, BlockLdlt& factor,
             const std::vector<Eigen::Vector3d>& b, std::vector<Eigen::Vector3d>& x);

  /// What the points of a step need: blocks of A^-1 between their knots alone. For a knot a in I, with
  /// g_a = L^-1 F_Ga, L L^T = F_GG, and u_a = M^-1 ((L^-1 F_GI A_IC)^T g_a - A_CI F_Ia), M M^T = S; for a
  /// knot in C, g_a = 0, u_a = M^-1 E_a:
  ///   (A^-1)_ab = [a and b in I] (F_ab - g_a^T g_b) + u_a^T u_b.
  /// u and g are kept per knot until the mesh changes.
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  /// Finds u and g of these knots (repeats allowed, at most kMostTouched), and F's columns of those among
  /// them that a cut laid open. Renewed before. False: no room.
  bool touch(const TissueModel& model, const TissueState& state, BlockLdlt& factor, const Index* knots,
             std::size_t count);
  /// Of touched knots. Rows: 3 per row of C, 3 per doubled node.
  auto u(Index knot) const { return touched_u_.middleRows(at(knot) * stride_u_, cutSize()); }
  auto g(Index knot) const { return touched_g_.middleRows(at(knot) * stride_g_, doubledSize()); }
  Eigen::Index cutSize() const { return 3 * static_cast<Eigen::Index>(rows_); }
  Eigen::Index doubledSize() const { return 3 * static_cast<Eigen::Index>(gammas_); }
  /// F_ab between touched knots; 0 unless both are in I.
  Eigen::Matrix3d whole(const TissueModel& model, const TissueState& state, Index a, Index b) const;

 private:
  Eigen::Index at(Index knot) const { return touched_of_[knot]; }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  struct Row {
    Index knot = 0;
    std::uint32_t elements = 0, inner = 0;  ///< of its mesh when it was taken: what they were
    std::uint32_t first = 0, count = 0;     ///< of its couplings
  };
  struct Coupling {
    Index node = 0;  ///< among the others
    Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
  };
  bool gather(const TissueModel& model, const TissueState& state);
  bool couple(const TissueModel& model, const TissueState& state, std::size_t row);
  void setColumns(const TissueModel& model, BlockLdlt& factor, std::size_t first_gamma);
  void setAnswers(const TissueModel& model, const TissueState& state, BlockLdlt& factor);

  std::uint32_t revision_ = 0;  ///< of the mesh that it is for; 0: none
  bool usable_ = false;
  std::size_t gammas_ = 0, rows_ = 0;      ///< in use
  std::vector<Index> gamma_;               ///< doubled nodes
  std::vector<std::int32_t> gamma_of_;     ///< per node; -1: not doubled
  std::vector<std::int32_t> row_of_;       ///< per knot; -1: none
  std::vector<Row> row_;                   ///< knots of doubled nodes and their copies
  std::vector<std::uint8_t> changed_;      ///< per row
  std::vector<Coupling> coupling_;         ///< kMostCouplings per row
  Eigen::MatrixXd columns_;                ///< F_:G
  Eigen::MatrixXd answers_;                ///< F A_IC
  RowMajor gamma_factor_;                  ///< Cholesky factor of F_GG, lower
  Eigen::MatrixXd gamma_answer_;           ///< F_GI A_IC
  RowMajor half_;                          ///< per unknown of C: L^-1 F_GI A_IC
  RowMajor own_;                           ///< A_CC - A_CI F A_IC
  RowMajor factor_;                        ///< Cholesky factor of S, lower
  Eigen::VectorXd work_, small_, at_cut_;  ///< scratch
  std::size_t touched_ = 0, opened_ = 0;   ///< in use
  std::vector<std::int32_t> touched_of_;   ///< per knot; -1: not touched since the mesh changed
  std::vector<std::int32_t> opened_of_;    ///< per node: columns in `opened_columns_`; -1: none
  Eigen::Index stride_u_ = 0, stride_g_ = 0;
  Columns touched_u_, touched_g_;
  Eigen::MatrixXd opened_columns_;  ///< of F: inner nodes that a cut laid open
};

}  // namespace vest::fem

#pragma once

#include "vest_tissue/fem/tissue.h"

/// The linear solve of a tissue's step, and what it is made of. For the steps alone.
namespace vest::fem {

inline bool corotational(const TissueModel& t) {
  return t.model->description.strain == Strain::Corotational;
}
inline bool isFree(const TissueModel& t, const TissueState& s, std::size_t knot) {
  return t.model->unknown[s.origin[knot]] >= 0;
}

/// Denatured collagen (docs/decisions/0020-…): shorter at rest, stiffer.
inline double shrinkOf(const TissueState& s, std::size_t e) {
  return s.denatured.empty() ? 0.0 : kShrinkage * static_cast<double>(s.denatured[e]);
}
inline double scaleOf(const TissueState& s, std::size_t e) {
  return s.denatured.empty() ? s.stiffness_scale
                             : s.stiffness_scale * (1.0 + kStiffening * static_cast<double>(s.denatured[e]));
}

inline Eigen::Matrix3d gradient(const Element& e, const std::array<Index, 4>& c,
                                const std::vector<Eigen::Vector3d>& field) {
  const Eigen::Vector3d& x0 = field[c[0]];
  Eigen::Matrix3d G = (field[c[1]] - x0) * e.gradient[1].transpose();
  G += (field[c[2]] - x0) * e.gradient[2].transpose();
  G += (field[c[3]] - x0) * e.gradient[3].transpose();
  return G;
}

/// out += corner forces of stress R·(2 mu e + lambda tr e), e = sym A.
inline void scatter(const Element& e, const Lame& law, const Eigen::Matrix3d& R, const Eigen::Matrix3d& A,
                    double scale, const std::array<Index, 4>& c, std::vector<Eigen::Vector3d>& out) {
  Eigen::Matrix3d stress = law.mu * (A + A.transpose());
  stress.diagonal().array() += law.lambda * A.trace();
  const Eigen::Matrix3d P = (-e.volume * scale) * (R * stress);
  const Eigen::Vector3d f1 = P * e.gradient[1], f2 = P * e.gradient[2], f3 = P * e.gradient[3];
  out[c[1]] += f1;
  out[c[2]] += f2;
  out[c[3]] += f3;
  out[c[0]] -= (f1 + f2) + f3;
}

/// out = -K_R v.
void minusStiffnessTimes(const TissueModel& t, const TissueState& s, const TissueScratch& w,
                         const std::vector<Eigen::Vector3d>& v, std::vector<Eigen::Vector3d>& out);

/// Whether the factor, of the mesh that is there, is that of the matrix itself.
bool exact(const TissueModel& t, const TissueState& s, const TissueScratch& w, double h);
/// Copies that cuts made.
inline bool divided(const TissueModel& t, const TissueState& s) {
  return s.x.size() > t.model->mass.size();
}
/// A knot in equilibrium, of an object that has a factor of its own.
bool still(const TissueModel& t, const TissueScratch& w, std::size_t knot);

/// The rigid part of a field on each group: an orthogonal projection, so that conjugate gradients between
/// projections are those of the constrained problem.
void makeRigid(const std::vector<TissueGroup>& groups, std::vector<Eigen::Vector3d>& field);
/// Of a group in equilibrium no mass slows the turn: without this the step overshoots where forces at the
/// arms are large beside the stiffness of the fold that it holds. Of the potential -f·R arm to second order,
/// (f·arm) I - sym(f arm^T), what is positive. `gravity`: m/s².
void findTurning(const TissueState& s, const Eigen::Vector3d& gravity, TissueScratch& w);

/// q = (mass_factor M + stiffness_factor K_R) p on free knots; h (h + delay) K_R p in equilibrium.
void matrixTimes(const TissueModel& t, const TissueState& s, double h, const TissueScratch& w,
                 const std::vector<Eigen::Vector3d>& p, std::vector<Eigen::Vector3d>& q);
/// w.v_next += A^-1 w.r with A = (1 + h a) M + h (h + b) K_R (h (h + delay) K_R in equilibrium), among the
/// changes that are rigid on each group; w.r becomes what is left, on the groups the opposite of their
/// impulses. Preconditioned conjugate gradients: each iterate lowers ½ x·A x - r·x, so that a solve that is
/// cut short stays bounded.
void solve(const TissueModel& t, const TissueState& s, double h, TissueScratch& w);
/// What the groups took: after each solve.
void addImpulses(TissueScratch& w);

}  // namespace vest::fem

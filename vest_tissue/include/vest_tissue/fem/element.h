#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "vest_tissue/fem/description.h"

namespace vest::fem {

/// Lamé's parameters, Pa: lambda = E nu / ((1+nu)(1-2nu)), mu = E / (2(1+nu)).
struct Lame {
  double lambda = 0.0, mu = 0.0;
};
Lame lame(const Material& material);

/// Linear tetrahedron: what its rest shape fixes. A field is interpolated as sum of N_a(X)·u_a.
struct Element {
  std::array<Index, 4> nodes{};
  std::array<Eigen::Vector3d, 4> gradient;  ///< dN_a/dX, 1/m
  double volume = 0.0;                      ///< m³
};

/// Corners of each face, outward for a positive volume.
inline constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

/// Six times the volume, m³; negative where the element is inverted.
double sixfoldVolume(const std::array<Eigen::Vector3d, 4>& corners);
Element makeElement(const std::array<Index, 4>& nodes, const std::array<Eigen::Vector3d, 4>& corners);

/// The proper rotation nearest to F in the Frobenius norm, the polar decomposition's where det F > 0.
/// Defined for every F: it is the eigenvector of the largest eigenvalue of a symmetric 4×4 matrix (Horn 1987,
/// doi 10.1364/JOSAA.4.000629), found by Jacobi rotations. Only + - * / sqrt: the same bits everywhere.
Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& F);

/// Eigenvalues and vectors (columns) of a symmetric 3×3 matrix by cyclic Jacobi rotations, unsorted.
void symmetricEigen(const Eigen::Matrix3d& S, Eigen::Vector3d& values, Eigen::Matrix3d& vectors);

/// du/dX of the element, from displacements of its corners.
Eigen::Matrix3d displacementGradient(const Element& element, const std::array<Eigen::Vector3d, 4>& u);

/// Strain energy, J. With G = du/dX, e = sym(R^T (1+G)) - 1 (corotational) or sym(G) (small, R = 1):
/// V (mu e:e + lambda/2 tr(e)²).
double energy(const Element& element, const Lame& law, const Eigen::Matrix3d& G, const Eigen::Matrix3d& R);

/// Forces on the four corners that the strain energy exerts: minus its gradient. First Piola-Kirchhoff stress
/// P = R (2 mu e + lambda tr(e) 1); force = -V P dN_a/dX. It is the exact gradient also for the corotational
/// law: the energy is stationary in R at the polar rotation. R e: with strain velocity instead of strain it
/// gives K_R v.
/// @param A  R^T (1+G) - 1, or R^T dv/dX
void cornerForces(const Element& element, const Lame& law, const Eigen::Matrix3d& R, const Eigen::Matrix3d& A,
                  std::array<Eigen::Vector3d, 4>& forces);

/// Block (a, b) of R K_e R^T, N/m, with h = R dN/dX: V (lambda h_a h_b^T + mu h_b h_a^T + mu h_a·h_b 1).
Eigen::Matrix3d stiffnessBlock(const Element& element, const Lame& law, const Eigen::Matrix3d& R, int a,
                               int b);

/// The rest of the corotational tangent, which comes from dR: V · sum_k kappa_k b_k b_k^T over the three
/// twist modes, kappa_k = 2 mu + (lambda (tr S - 3) - 2 mu)·2/(s_i + s_j), s: eigenvalues of S = sym(R^T F)
/// (eigenmodes as in Smith et al. 2019, doi 10.1145/3241041).
struct Twist {
  double kappa[3];                      ///< Pa
  std::array<Eigen::Vector3d, 4> b[3];  ///< 1/m, per mode and corner
};
Twist twist(const Element& element, const Lame& law, const Eigen::Matrix3d& R, const Eigen::Matrix3d& F);

}  // namespace vest::fem

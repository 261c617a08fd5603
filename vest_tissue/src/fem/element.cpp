#include "vest_tissue/fem/element.h"

#include <algorithm>
#include <cmath>

namespace vest::fem {
namespace {

/// Cyclic Jacobi: A becomes diagonal, the columns of V its eigenvectors. Quadratic convergence: 12 sweeps are
/// plenty.
template <int N>
void jacobi(Eigen::Matrix<double, N, N>& A, Eigen::Matrix<double, N, N>& V) {
  V.setIdentity();
  for (int sweep = 0; sweep < 12; ++sweep) {
    double off = 0.0, scale = 0.0;
    for (int i = 0; i < N; ++i) {
      scale += A(i, i) * A(i, i);
      for (int j = i + 1; j < N; ++j) off += A(i, j) * A(i, j);
    }
    if (!(off > 1e-36 * scale)) return;
    for (int p = 0; p < N; ++p) {
      for (int q = p + 1; q < N; ++q) {
        if (A(p, q) == 0.0) continue;
        const double theta = (A(q, q) - A(p, p)) / (2.0 * A(p, q));
        const double t = (theta >= 0.0 ? 1.0 : -1.0) / (std::abs(theta) + std::sqrt(theta * theta + 1.0));
        const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < N; ++k) {
          const double kp = A(k, p), kq = A(k, q);
          A(k, p) = c * kp - s * kq;
          A(k, q) = s * kp + c * kq;
        }
        for (int k = 0; k < N; ++k) {
          const double pk = A(p, k), qk = A(q, k);
          A(p, k) = c * pk - s * qk;
          A(q, k) = s * pk + c * qk;
        }
        for (int k = 0; k < N; ++k) {
          const double kp = V(k, p), kq = V(k, q);
          V(k, p) = c * kp - s * kq;
          V(k, q) = s * kp + c * kq;
        }
      }
    }
  }
}

}  // namespace

Lame lame(const Material& m) {
  return {m.youngs_modulus * m.poisson_ratio / ((1.0 + m.poisson_ratio) * (1.0 - 2.0 * m.poisson_ratio)),
          m.youngs_modulus / (2.0 * (1.0 + m.poisson_ratio))};
}

double sixfoldVolume(const std::array<Eigen::Vector3d, 4>& x) {
  return (x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0]));
}

Element makeElement(const std::array<Index, 4>& nodes, const std::array<Eigen::Vector3d, 4>& x) {
  Element e;
  e.nodes = nodes;
  const Eigen::Vector3d e1 = x[1] - x[0], e2 = x[2] - x[0], e3 = x[3] - x[0];
  const double six = sixfoldVolume(x);
  e.volume = six / 6.0;
  e.gradient[1] = e2.cross(e3) / six;
  e.gradient[2] = e3.cross(e1) / six;
  e.gradient[3] = e1.cross(e2) / six;
  e.gradient[0] = -(e.gradient[1] + e.gradient[2] + e.gradient[3]);
  return e;
}

Eigen::Matrix3d nearestRotation(const Eigen::Matrix3d& F) {
  Eigen::Matrix4d N, V;
  N(0, 0) = F(0, 0) + F(1, 1) + F(2, 2);
  N(1, 1) = F(0, 0) - F(1, 1) - F(2, 2);
  N(2, 2) = -F(0, 0) + F(1, 1) - F(2, 2);
  N(3, 3) = -F(0, 0) - F(1, 1) + F(2, 2);
  N(0, 1) = N(1, 0) = F(2, 1) - F(1, 2);
  N(0, 2) = N(2, 0) = F(0, 2) - F(2, 0);
  N(0, 3) = N(3, 0) = F(1, 0) - F(0, 1);
  N(1, 2) = N(2, 1) = F(1, 0) + F(0, 1);
  N(1, 3) = N(3, 1) = F(0, 2) + F(2, 0);
  N(2, 3) = N(3, 2) = F(2, 1) + F(1, 2);
  jacobi<4>(N, V);
  int best = 0;
  for (int k = 1; k < 4; ++k) {
    if (N(k, k) > N(best, best)) best = k;
  }
  Eigen::Vector4d q = V.col(best);
  q /= std::sqrt(q.squaredNorm());
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  Eigen::Matrix3d R;
  R << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
      2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),   //
      2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y);
  return R;
}

void symmetricEigen(const Eigen::Matrix3d& S, Eigen::Vector3d& values, Eigen::Matrix3d& vectors) {
  Eigen::Matrix3d A = S;
  jacobi<3>(A, vectors);
  values = A.diagonal();
}

Eigen::Matrix3d displacementGradient(const Element& e, const std::array<Eigen::Vector3d, 4>& u) {
  Eigen::Matrix3d G = (u[1] - u[0]) * e.gradient[1].transpose();
  G += (u[2] - u[0]) * e.gradient[2].transpose();
  G += (u[3] - u[0]) * e.gradient[3].transpose();
  return G;
}

double energy(const Element& e, const Lame& law, const Eigen::Matrix3d& G, const Eigen::Matrix3d& R) {
  // R^T (1 + G) - 1 written as R^T G + (R^T - 1): exact for R = 1.
  const Eigen::Matrix3d A = R.transpose() * G + (R.transpose() - Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d strain = 0.5 * (A + A.transpose());
  const double tr = strain.trace();
  return e.volume * (law.mu * strain.squaredNorm() + 0.5 * law.lambda * tr * tr);
}

void cornerForces(const Element& e, const Lame& law, const Eigen::Matrix3d& R, const Eigen::Matrix3d& A,
                  std::array<Eigen::Vector3d, 4>& forces) {
  Eigen::Matrix3d stress = law.mu * (A + A.transpose());
  stress.diagonal().array() += law.lambda * A.trace();
  const Eigen::Matrix3d P = (-e.volume) * (R * stress);
  for (int a = 1; a < 4; ++a) forces[a] = P * e.gradient[a];
  forces[0] = -(forces[1] + forces[2] + forces[3]);
}

Eigen::Matrix3d stiffnessBlock(const Element& e, const Lame& law, const Eigen::Matrix3d& R, int a, int b) {
  const Eigen::Vector3d ha = R * e.gradient[a], hb = R * e.gradient[b];
  Eigen::Matrix3d K =
      (e.volume * law.lambda) * (ha * hb.transpose()) + (e.volume * law.mu) * (hb * ha.transpose());
  K.diagonal().array() += e.volume * law.mu * ha.dot(hb);
  return K;
}

Twist twist(const Element& e, const Lame& law, const Eigen::Matrix3d& R, const Eigen::Matrix3d& F) {
  Twist result;
  const Eigen::Matrix3d A = R.transpose() * F;
  Eigen::Vector3d s;
  Eigen::Matrix3d V;
  symmetricEigen(0.5 * (A + A.transpose()), s, V);
  const double pull = law.lambda * (s.sum() - 3.0) - 2.0 * law.mu;
  for (int k = 0; k < 3; ++k) {
    // Near a degenerate shape the rotation jumps; a floor keeps the tangent finite there.
    const double gap = std::max(s[(k + 1) % 3] + s[(k + 2) % 3], 1e-3);
    result.kappa[k] = 2.0 * law.mu + 2.0 * pull / gap;
    const Eigen::Vector3d axis = R * V.col(k);
    for (int a = 0; a < 4; ++a) result.b[k][a] = axis.cross(R * e.gradient[a]) * std::sqrt(0.5);
  }
  return result;
}

}  // namespace vest::fem

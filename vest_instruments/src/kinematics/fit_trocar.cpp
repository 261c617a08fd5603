#include "vest_instruments/kinematics/fit_trocar.h"

#include <cmath>

#include <Eigen/Dense>

namespace vest::kinematics {
namespace {

using Eigen::Vector3d;
using Unknowns = Eigen::Matrix<double, 5, 1>;  // pivot, and two small turns of the aim across the first guess

constexpr double kReach = 0.1;  // m from pivot to aim

struct Guess {
  Vector3d pivot, z, across, other;
};

Vector3d aimOf(const Guess& g, const Unknowns& u) {
  const Vector3d z = (g.z + u[3] * g.across + u[4] * g.other).normalized();
  return g.pivot + u.head<3>() + kReach * z;
}

Eigen::VectorXd distances(const Guess& g, const Unknowns& u, const std::vector<Touch>& touches) {
  const Eigen::Isometry3d X = trocarFrame(g.pivot + u.head<3>(), aimOf(g, u));
  Eigen::VectorXd out(3 * static_cast<Eigen::Index>(touches.size()));
  Eigen::Index row = 0;
  for (const Touch& t : touches) {
    out.segment<3>(row) = forwardKinematics(X, t.joints).translation() - t.point_B;
    row += 3;
  }
  return out;
}

}  // namespace

TrocarFit fitTrocar(const std::vector<Touch>& touches, const Vector3d& pivot_B, const Vector3d& aim_B) {
  if (touches.size() < 3)
    throw files::FileError(std::to_string(touches.size()) + " touched points; allowed: three or more");
  Guess g{pivot_B, (aim_B - pivot_B).normalized(), {}, {}};
  g.across = g.z.unitOrthogonal();
  g.other = g.z.cross(g.across);
  Unknowns u = Unknowns::Zero();
  for (int round = 0; round < 50; ++round) {
    const Eigen::VectorXd e = distances(g, u, touches);
    Eigen::Matrix<double, Eigen::Dynamic, 5> J(e.size(), 5);
    constexpr double h = 1e-6;
    for (int k = 0; k < 5; ++k) {
      Unknowns more = u, less = u;
      more[k] += h, less[k] -= h;
      J.col(k) = (distances(g, more, touches) - distances(g, less, touches)) / (2 * h);
    }
    const auto qr = J.colPivHouseholderQr();
    // Lengths of the columns: 1 of the pivot, the insertion of the turns.
    if (std::abs(qr.matrixQR()(4, 4)) < 1e-3)
      throw files::FileError(
          "the touched points do not tell pivot and aim; allowed: points that lie well apart, also in depth");
    const Unknowns step = qr.solve(-e);
    u += step;
    if (!u.allFinite() || u.norm() > 2.0)
      throw files::FileError(
          "no trocar fits the touched points; allowed: points in metres in the box, joints of the same "
          "moment");
    if (step.norm() < 1e-10) break;
  }
  TrocarFit fit;
  fit.pivot_B = g.pivot + u.head<3>();
  fit.aim_B = aimOf(g, u);
  fit.error = std::sqrt(distances(g, u, touches).squaredNorm() / static_cast<double>(touches.size()));
  return fit;
}

}  // namespace vest::kinematics

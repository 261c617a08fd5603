#include "vest_tissue/interaction/blade_sweep.h"

#include <cmath>

#include <Eigen/Geometry>

#include "vest_instruments/tools/tool_geometry.h"

namespace vest::interaction {

using Eigen::Vector3d;

namespace {

/// Sine and cosine by their series for |h| < 0.7: the same bits everywhere.
void turn(double h, double& s, double& c) {
  const double h2 = h * h;
  s = h * (1 - h2 / 6 * (1 - h2 / 20 * (1 - h2 / 42 * (1 - h2 / 72))));
  c = 1 - h2 / 2 * (1 - h2 / 12 * (1 - h2 / 30 * (1 - h2 / 56)));
}

/// Segment against one triangle, a little larger than it is, so that two that share an edge leave no gap.
bool crossesTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& p,
                     const Vector3d& q, double slack, double& place, double weights[3], Vector3d& normal) {
  constexpr double kSkirt = 1e-3;
  const Vector3d n = (b - a).cross(c - a);
  const double squared = n.squaredNorm();
  if (!(squared > 1e-24)) return false;  // m⁴: nothing swept
  const double dp = n.dot(p - a), dq = n.dot(q - a), span = dp - dq;
  if (!(span * span > 1e-12 * squared * (q - p).squaredNorm())) return false;  // within the surface
  place = dp / span;
  if (!(place > -slack && place < 1.0 + slack)) return false;
  const Vector3d x = p + place * (q - p);
  weights[0] = n.dot((b - x).cross(c - x)) / squared;
  weights[1] = n.dot((c - x).cross(a - x)) / squared;
  weights[2] = 1.0 - weights[0] - weights[1];
  if (weights[0] < -kSkirt || weights[1] < -kSkirt || weights[2] < -kSkirt) return false;
  normal = n / std::sqrt(squared);
  if (dq < dp) normal = -normal;
  return true;
}

}  // namespace

int bladeEdges(tools::ToolKind kind, const ToolPose& pose,
               std::array<std::array<Vector3d, 2>, kBladesPerTool>& edges) {
  const tools::ToolGeometry& g = tools::toolGeometry(kind);
  const Eigen::Matrix3d r = pose.orientation.toRotationMatrix();
  if (kind == tools::ToolKind::Scissors) {
    double s, c;
    turn(0.5 * pose.jaw - kBladeOverlap, s, c);
    const Vector3d axis = pose.tip - r.col(2) * g.jaw_length;
    for (int side = 0; side < 2; ++side) {
      const Vector3d along = r * Vector3d(side == 0 ? s : -s, 0, c);
      edges[static_cast<std::size_t>(side)] = {axis, axis + along * g.jaw_length};
    }
    return 2;
  }
  if (kind == tools::ToolKind::CoagulationHook && g.fixed.size() >= 3) {
    for (std::size_t i = 0; i < 2; ++i)
      edges[i] = {pose.tip + r * g.fixed[i + 1].a, pose.tip + r * g.fixed[i + 1].b};
    return 2;
  }
  return 0;
}

int sweepsOf(const Proxy& before, const Proxy& after, std::uint32_t functions, double dt,
             std::uint8_t instrument, BladeSweep* out) {
  if (!before.present || !after.present || before.tool != after.tool) return 0;
  std::array<std::array<Vector3d, 2>, kBladesPerTool> from, to;
  const int count = bladeEdges(after.tool, after.pose, to);
  bladeEdges(before.tool, before.pose, from);
  const bool scissors = after.tool == tools::ToolKind::Scissors;
  for (int i = 0; i < count; ++i) {
    BladeSweep& sweep = out[i];
    sweep.electric = !scissors;
    sweep.active = scissors ? before.pose.jaw - after.pose.jaw > kCuttingJawSpeed * dt
                            : (functions & tools::kFunctionCut) != 0;
    sweep.instrument = instrument;
    sweep.blade = static_cast<std::uint8_t>(i);
    sweep.from = from[static_cast<std::size_t>(i)];
    sweep.to = to[static_cast<std::size_t>(i)];
  }
  return count;
}

bool crosses(const BladeSweep& sweep, const Vector3d& p, const Vector3d& q, const Vector3d& shift,
             double slack, BladeCrossing& crossing) {
  const Vector3d a = sweep.from[0] + shift, b = sweep.from[1] + shift;
  const Vector3d &c = sweep.to[1], &d = sweep.to[0];
  double w[3];
  if (crossesTriangle(a, b, c, p, q, slack, crossing.place, w, crossing.normal)) {
    crossing.along = 1.0 - w[0];
    return true;
  }
  if (crossesTriangle(a, c, d, p, q, slack, crossing.place, w, crossing.normal)) {
    crossing.along = w[1];
    return true;
  }
  return false;
}

}  // namespace vest::interaction

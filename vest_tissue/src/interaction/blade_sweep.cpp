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

double triple(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return a.dot(b.cross(c));
}

/// Where two lines that (nearly) lie in a plane meet, on both: p + s e = b + u d. False where parallel.
bool meet(const Vector3d& e, const Vector3d& d, const Vector3d& r, double& s, double& u) {  // r = p - b
  const Vector3d n = e.cross(d);
  const double squared = n.squaredNorm();
  if (!(squared > 1e-12 * e.squaredNorm() * d.squaredNorm())) return false;
  s = -triple(r, d, n) / squared;
  u = -triple(r, e, n) / squared;
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

bool crosses(const BladeSweep& sweep, const MovingSegment& segment, double slack, double& place) {
  constexpr double kSkirt = 1e-3;  // of the blade's edge, beyond its ends
  const Vector3d e0 = segment.from[1] - segment.from[0], e1 = segment.to[1] - segment.to[0],
                 d0 = sweep.from[1] - sweep.from[0], d1 = sweep.to[1] - sweep.to[0],
                 r0 = segment.from[0] - sweep.from[0], r1 = segment.to[0] - sweep.to[0];
  const Vector3d e = e1 - e0, d = d1 - d0, r = r1 - r0;
  // Volume that the four ends span, c0 + c1 t + c2 t² + c3 t³: zero where they lie in one plane.
  const double c0 = triple(e0, d0, r0), c3 = triple(e, d, r),
               c1 = triple(e, d0, r0) + triple(e0, d, r0) + triple(e0, d0, r),
               c2 = triple(e0, d, r) + triple(e, d0, r) + triple(e, d, r0);
  const auto volume = [&](double t) { return c0 + t * (c1 + t * (c2 + t * c3)); };
  // Between its extremes it is monotone. At the ends of the step it is taken from the places there: the next
  // step begins with the same bits.
  std::array<double, 4> t{0.0, 1.0, 1.0, 1.0}, v{c0, 0.0, 0.0, 0.0};
  std::size_t last = 0;
  const double root = c2 * c2 - 3.0 * c1 * c3;
  if (root > 0.0) {
    const double w = -(c2 + std::copysign(std::sqrt(root), c2));
    const double a = w / (3.0 * c3), b = c1 / w;
    for (const double x : {std::fmin(a, b), std::fmax(a, b)})
      if (x > 0.0 && x < 1.0) t[++last] = x, v[last] = volume(x);
  }
  t[++last] = 1.0, v[last] = triple(e1, d1, r1);
  for (std::size_t i = 0; i < last; ++i) {
    if ((v[i] < 0.0) == (v[i + 1] < 0.0)) continue;
    double low = t[i], high = t[i + 1];
    for (int n = 0; n < 40; ++n) {
      const double middle = 0.5 * (low + high);
      ((volume(middle) < 0.0) == (v[i] < 0.0) ? low : high) = middle;
    }
    double along;
    if (meet(e0 + low * e, d0 + low * d, r0 + low * r, place, along) && place > -slack &&
        place < 1.0 + slack && along > -kSkirt && along < 1.0 + kSkirt)
      return true;
  }
  return false;
}

}  // namespace vest::interaction

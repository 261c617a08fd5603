#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "stages.h"
#include "vest_tissue/interaction/grasp.h"

/// Which tissue lies between a tool's jaws: for jaws that hold and for those that set clips.
namespace vest::scene {

/// Places on a triangle that are looked at: corners, middles of the edges, centroid.
inline constexpr double kSamples[7][3] = {{1, 0, 0},
                                          {0, 1, 0},
                                          {0, 0, 1},
                                          {0.5, 0.5, 0},
                                          {0, 0.5, 0.5},
                                          {0.5, 0, 0.5},
                                          {1.0 / 3, 1.0 / 3, 1.0 / 3}};

/// Frame of a tool's tip.
struct JawFrame {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d tip;
  Eigen::Vector3d local(const Eigen::Vector3d& p) const { return rotation.transpose() * (p - tip); }
  Eigen::Vector3d world(const Eigen::Vector3d& p) const { return tip + rotation * p; }
};

/// Opening that something round fills at a place between jaws.
inline double filledJaw(const tools::ToolGeometry& g, const Eigen::Vector3d& local, double radius) {
  return 2.0 * radius / std::max(1e-4, local.z() + g.jaw_length);
}

/// A place of a thread or needle (ThreadModel::places) was between the instrument's jaws in the last step.
inline bool wasBetween(const Context& c, int tool, std::uint32_t place) {
  interaction::ThreadTouch face;
  face.segment = place, face.kind = interaction::TouchKind::JawFace;
  face.body = static_cast<std::uint16_t>(tool);
  const auto& kept = c.state.threads.touches;
  const auto at = std::lower_bound(kept.begin(), kept.end(), face,
                                   [](const auto& a, const auto& b) { return interaction::before(a, b); });
  return at != kept.end() && at->segment == place && at->kind == face.kind && at->body == face.body;
}

/// Jaws let in what is thinner than their gap; as they close on it, it stays. Closed jaws are solid, but for
/// what is in them as they appear.
inline bool isBetween(const Context& c, int tool, const tools::ToolGeometry& g, const JawFrame& frame,
                      std::uint32_t place) {
  if (c.scratch.threads->apart[place] != 0) return false;
  const ThreadModel& m = c.model.threads;
  const double jaw = c.scratch.proxies_before[tool].pose.jaw;
  const Eigen::Vector3d local = frame.local(m.at(c.state.threads.rod, place));
  const double at = interaction::jawAngleAt(g, local, 0.0);
  if (!(at >= 0.0 && at <= jaw + 0.05)) return false;
  return filledJaw(g, local, m.places[place].radius) <= jaw || c.scratch.appeared[tool] ||
         wasBetween(c, tool, place);
}

/// Per knot of an object, in ObjectScratch::near, on which sides of the jaws it lies for certain: samples lie
/// between the corners, so that a triangle whose corners share a side has none in them. kFar: further from
/// the middle than `reach`. In single precision, with room for its rounding. @return whether any is near
inline constexpr std::uint8_t kFar = 64;
inline bool findSides(const ObjectState& s, ObjectScratch& o, const tools::ToolGeometry& g,
                      const JawFrame& frame, const Eigen::Vector3d& middle, double reach) {
  constexpr float kRoom = 1e-5f;  // m: far more than single precision loses in a box of 1 m
  const Eigen::Matrix3f to_jaws = frame.rotation.transpose().cast<float>();
  const Eigen::Vector3f tip = frame.tip.cast<float>();
  const float half = static_cast<float>(interaction::kJawHalfWidth) + kRoom,
              length = static_cast<float>(g.jaw_length) + kRoom, far = static_cast<float>(reach) + kRoom,
              far2 = far * far, cx = static_cast<float>(middle.x()), cy = static_cast<float>(middle.y()),
              cz = static_cast<float>(middle.z());
  const float *x = row(s, net::Block::X), *y = row(s, net::Block::Y), *z = row(s, net::Block::Z);
  const std::size_t knots = s.block.knots();
  std::uint8_t* const out = o.near.data();
  unsigned any = 0;
  for (std::size_t i = 0; i < knots; ++i) {  // vectorises
    const float dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz;
    const std::uint8_t is = dx * dx + dy * dy + dz * dz < far2;
    out[i] = is;
    any |= is;
  }
  if (any == 0) return false;
  // A corner beyond the reach may belong to a triangle within it: its sides count, too.
  for (std::size_t i = 0; i < knots; ++i) {
    const Eigen::Vector3f p = to_jaws * (Eigen::Vector3f(x[i], y[i], z[i]) - tip);
    const int sides = (p.y() > half    ? 1
                       : p.y() < -half ? 2
                                       : 0) |
                      (p.z() > kRoom     ? 4
                       : p.z() < -length ? 8
                                         : 0) |
                      (p.x() > length    ? 16
                       : p.x() < -length ? 32
                                         : 0);
    out[i] = static_cast<std::uint8_t>(sides | (out[i] != 0 ? 0 : kFar));
  }
  return true;
}

/// Calls visit(object, triangle, corner positions, sample, angle) for each sample between open jaws.
template <typename Visit>
void eachBetween(Context& c, const tools::ToolGeometry& g, const JawFrame& frame, double angle, Visit visit) {
  const Eigen::Vector3d axis = frame.world(Eigen::Vector3d(0, 0, -g.jaw_length)),
                        middle = 0.5 * (axis + frame.tip);
  for (const std::size_t object : c.model.bodies) {
    const ObjectState& s = c.state.objects[object];
    ObjectScratch& o = c.scratch.objects[object];
    const double reach = g.jaw_length + c.model.objects[object].greatest_edge;
    bool apart = false;
    for (int e = 0; e < 3; ++e)
      apart = apart || middle[e] - reach > o.high[e] || middle[e] + reach < o.low[e];
    if (apart) continue;
    const double thickness = c.model.description.objects[object].contact_thickness;
    if (!findSides(s, o, g, frame, middle, reach)) continue;
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const auto& k = s.triangles[t];
      if ((o.near[k[0]] & kFar) != 0 || (o.near[k[0]] & o.near[k[1]] & o.near[k[2]] & (kFar - 1)) != 0)
        continue;
      const Eigen::Vector3d p0 = knotPosition(s, k[0]);
      if ((p0 - middle).squaredNorm() > reach * reach || !s.triangle_alive[t]) continue;
      const std::array<Eigen::Vector3d, 3> p{frame.local(p0), frame.local(knotPosition(s, k[1])),
                                             frame.local(knotPosition(s, k[2]))};
      // Samples lie between the corners: what has these all on one side of the jaws has none in them.
      const Eigen::Vector3d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]),
                            high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
      if (low.y() > interaction::kJawHalfWidth || high.y() < -interaction::kJawHalfWidth || low.z() > 0.0 ||
          high.z() < -g.jaw_length || low.x() > g.jaw_length || high.x() < -g.jaw_length)
        continue;
      for (const auto& w : kSamples) {
        const double at = interaction::jawAngleAt(g, p[0] * w[0] + p[1] * w[1] + p[2] * w[2], thickness);
        if (at >= 0.0 && at <= angle) visit(object, t, w, at);
      }
    }
  }
}

}  // namespace vest::scene

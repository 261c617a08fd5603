#pragma once

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

/// Calls visit(object, triangle, corner positions, sample, angle) for each sample between open jaws.
template <typename Visit>
void eachBetween(Context& c, const tools::ToolGeometry& g, const JawFrame& frame, double angle, Visit visit) {
  const Eigen::Vector3d axis = frame.world(Eigen::Vector3d(0, 0, -g.jaw_length)),
                        middle = 0.5 * (axis + frame.tip);
  for (const std::size_t object : c.model.bodies) {
    const ObjectState& s = c.state.objects[object];
    const ObjectScratch& o = c.scratch.objects[object];
    const double reach = g.jaw_length + c.model.objects[object].greatest_edge;
    bool apart = false;
    for (int e = 0; e < 3; ++e)
      apart = apart || middle[e] - reach > o.high[e] || middle[e] + reach < o.low[e];
    if (apart) continue;
    const double thickness = c.model.description.objects[object].contact_thickness;
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const auto& k = s.triangles[t];
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

#include "vest_tissue/interaction/grasp.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/net/elements.h"

namespace vest::interaction {

bool hasJaws(tools::ToolKind kind) {
  return kind == tools::ToolKind::Grasper || kind == tools::ToolKind::BipolarForceps ||
         kind == tools::ToolKind::NeedleHolder;
}

double jawAngleAt(const tools::ToolGeometry& g, const Eigen::Vector3d& local, double thickness) {
  const double along = local.z() + g.jaw_length, side = std::fabs(local.x());
  if (std::fabs(local.y()) > kJawHalfWidth || along <= 0.1 * g.jaw_length) return -1.0;
  const double radius = std::sqrt(along * along + side * side);
  if (radius > g.jaw_length) return -1.0;
  const double half = net::angleOf(static_cast<float>(side), static_cast<float>(along));
  return 2.0 * (half + thickness / radius);
}

double pinchForce(double jaw, double jaw_at_touch) {
  if (!(jaw_at_touch > 0.0)) return 0.0;
  const double closure = std::clamp(1.0 - jaw / jaw_at_touch, 0.0, 1.0);
  return kGreatestPinch * closure * closure;
}

}  // namespace vest::interaction

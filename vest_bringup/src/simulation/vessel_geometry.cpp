#include "vessel_geometry.h"

#include <algorithm>
#include <cmath>

namespace vest::simulation {

using Eigen::Vector3d;

namespace {
constexpr double kPi = 3.14159265358979323846;
}

Vector3d ringCentre(const scene::World& world, std::size_t object, const net::TubeMap& tube,
                    std::size_t ring) {
  Vector3d sum = Vector3d::Zero();
  for (const auto knot : tube.knots(ring)) sum += world.knotAt(object, knot);
  return sum / static_cast<double>(tube.knots(ring).size());
}

double enclosed(const scene::World& world, std::size_t object, const net::TubeMap& tube, std::size_t ring,
                const Vector3d& centre) {
  Vector3d sum = Vector3d::Zero();
  const auto& knots = tube.knots(ring);
  Vector3d before = world.knotAt(object, knots.back()) - centre;
  for (const auto knot : knots) {
    const Vector3d next = world.knotAt(object, knot) - centre;
    sum += before.cross(next);
    before = next;
  }
  return 0.5 * std::sqrt(sum.squaredNorm());
}

double crossSection(const scene::World& world, std::size_t object, const net::TubeMap& tube,
                    std::size_t ring) {
  const Vector3d centre = ringCentre(world, object, tube, ring);
  double sum = 0;
  for (const auto knot : tube.knots(ring))
    sum += std::sqrt((world.knotAt(object, knot) - centre).squaredNorm());
  const double r = sum / static_cast<double>(tube.knots(ring).size());
  return kPi * r * r;
}

double cutShare(double area, double wall, double cross_section) {
  const double radius = std::sqrt(cross_section / kPi);
  return std::min(1.0, area / (2 * kPi * radius * (wall > 0 ? wall : 0.1 * radius)));
}

}  // namespace vest::simulation

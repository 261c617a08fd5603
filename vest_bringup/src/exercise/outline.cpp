#include "vest_bringup/exercise/outline.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/scene/world_model.h"

namespace vest::exercise {
namespace {

using Eigen::Vector3d;

constexpr double kLift =
    0.0003;  ///< m above the surface of knots, so that the line is not half in it (tuned)
constexpr std::size_t kPoints = 32;

/// Empty where the mark does not lie inside a tube: a knot is nearer than the middle of any ring.
std::vector<Vector3d> aroundTube(const scene::World& world, std::size_t object, const Vector3d& at) {
  const net::TubeMap& tube = world.model().objects[object].tube;
  std::vector<Vector3d> best;
  double nearest = 1e300;
  for (std::size_t k = 0; k < world.knotCount(object); ++k)
    nearest = std::min(nearest, (world.knotAt(object, k) - at).squaredNorm());
  for (std::size_t ring = 0; ring < tube.ringCount(); ++ring) {
    std::vector<Vector3d> line;
    Vector3d middle = Vector3d::Zero();
    for (const std::uint32_t k : tube.knots(ring)) {
      line.push_back(world.knotAt(object, k));
      middle += line.back() / static_cast<double>(tube.knots(ring).size());
    }
    const double d = (middle - at).squaredNorm();
    if (line.size() < 3 || d >= nearest) continue;
    nearest = d;
    for (Vector3d& p : line) p += kLift * (p - middle).normalized();
    best = std::move(line);
  }
  return best;
}

std::vector<Vector3d> onSurface(const scene::World& world, std::size_t object, const Mark& mark) {
  std::size_t knot = 0;
  double nearest = 1e300;
  for (std::size_t k = 0; k < world.knotCount(object); ++k) {
    const double d = (world.knotAt(object, k) - mark.at).squaredNorm();
    if (d < nearest) nearest = d, knot = k;
  }
  Vector3d normal = Vector3d::Zero();
  for (const auto& t : world.description().objects[object].contact_triangles) {
    if (std::find(t.begin(), t.end(), knot) == t.end()) continue;
    const Vector3d a = world.knotAt(object, t[0]);
    normal += (world.knotAt(object, t[1]) - a).cross(world.knotAt(object, t[2]) - a);
  }
  if (!(normal.norm() > 0)) return {};
  normal.normalize();
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u), middle = world.knotAt(object, knot);
  std::vector<Vector3d> line;
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double angle = 2 * M_PI * static_cast<double>(i) / kPoints;
    line.push_back(middle + kLift * normal + mark.radius * (std::cos(angle) * u + std::sin(angle) * v));
  }
  return line;
}

}  // namespace

std::vector<Outline> outlinesOf(const Exercise& exercise, const scene::World& world) {
  std::vector<Outline> out;
  const auto& objects = world.description().objects;
  for (const Mark& mark : exercise.marks) {
    const auto of = std::find_if(objects.begin(), objects.end(),
                                 [&](const scene::Object& o) { return o.name == mark.object; });
    if (mark.middle || of == objects.end()) continue;
    const auto object = static_cast<std::size_t>(of - objects.begin());
    auto line = aroundTube(world, object, mark.at);
    if (line.empty()) line = onSurface(world, object, mark);
    if (!line.empty()) out.push_back({mark.name, mark.object, std::move(line)});
  }
  return out;
}

}  // namespace vest::exercise

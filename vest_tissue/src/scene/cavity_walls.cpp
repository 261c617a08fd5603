#include "vest_tissue/scene/cavity_walls.h"

#include <algorithm>

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// Of a gradient, squared: less is that of a table of distances that ends there, and says nothing of a wall
/// (tuned).
constexpr float kWhole = 0.5f;

}  // namespace

bool CavityWalls::lower(std::size_t object, const Vector3f& p, float& distance, Vector3f& gradient) const {
  if (!sink() || !isCavity(object)) return false;
  const contact::SunkenWall hanging = wall(object);
  const auto [least, greatest] = hanging.above(p.cast<double>());
  bool is = false;
  for (const double z : {least, greatest}) {
    if (!(z > static_cast<double>(p.z()))) continue;
    const Vector3f above(p.x(), p.y(), static_cast<float>(z));
    Vector3f down;
    float there = model_.objects[object].grid.distance(above, down);
    if (z > hanging.high) there = std::min(there, static_cast<float>(hanging.high - z));
    if (down.squaredNorm() < kWhole) down = -Vector3f::UnitZ();  // far beyond it
    if (!(there < distance)) continue;
    distance = there, gradient = down, is = true;
  }
  return is;
}

void CavityWalls::hang(std::size_t object, float* xyz, std::size_t knots) const {
  if (!sink() || !isCavity(object)) return;
  const contact::SunkenWall hanging = wall(object);
  for (std::size_t k = 0; k < knots; ++k, xyz += 3)
    xyz[2] -= static_cast<float>(hanging.by(Vector3d(xyz[0], xyz[1], xyz[2])));
}

double roofOver(const WorldModel& model, double x, double y) {
  double roof = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < model.objects.size(); ++i) {
    const ObjectConstants& o = model.objects[i];
    if (model.description.objects[i].organ != "cavity" || o.grid.empty()) continue;
    for (double z = o.highest; z > o.lowest && !(roof >= z); z -= o.grid.spacing()) {
      // Beyond the table it says `band`, which is no room.
      Vector3f gradient;
      const float d = o.grid.distance(Vector3d(x, y, z).cast<float>(), gradient);
      if (d > 0.0f && d < static_cast<float>(o.grid.band())) roof = z;
    }
  }
  return roof;
}

}  // namespace vest::scene

#include "vest_viz/mesh/sunken_wall.h"

#include <algorithm>
#include <cmath>

namespace vest::mesh {
namespace {

constexpr double kFalls = 0.5;   ///< no unit: how steeply a tent falls off beside its pole (assumed)
constexpr double kOver = 0.003;  ///< m over the shaft, as thick as the wall; its vertices lie apart (assumed)

/// m: of the tent over `place`, a vertex at rest; −infinity: no shaft is below it.
double tentOver(const std::vector<TentPole>& shafts, const Eigen::Vector3d& place) {
  double height = -INFINITY;
  for (const TentPole& shaft : shafts) {
    const Eigen::Vector3d way = shaft.to - shaft.from;
    const double length = way.head<2>().squaredNorm();
    const double share =
        length > 0 ? std::clamp((place - shaft.from).head<2>().dot(way.head<2>()) / length, 0.0, 1.0) : 1.0;
    const Eigen::Vector3d under = shaft.from + share * way;
    if (!(under.z() < place.z())) continue;
    const double beside = std::max(0.0, (place - under).head<2>().norm() - shaft.radius);
    height = std::max(height, under.z() + shaft.radius + kOver - kFalls * beside);
  }
  return height;
}

}  // namespace

void sinkWall(double sunk, const Eigen::Vector3d& lens, const std::vector<TentPole>& shafts,
              std::vector<float>* positions) {
  if (!(sunk > 0) || !std::isfinite(sunk) || !lens.allFinite() || positions->size() < 3) return;
  float low = (*positions)[2], high = low;
  for (std::size_t i = 2; i < positions->size(); i += 3)
    low = std::min(low, (*positions)[i]), high = std::max(high, (*positions)[i]);
  contact::SunkenWall wall;
  wall.sunk = sunk, wall.high = static_cast<double>(high), wall.propped = true, wall.lens = lens;
  wall.middle = 0.5 * (static_cast<double>(low) + wall.high);
  if (!(wall.high > wall.middle)) return;
  for (std::size_t i = 0; i + 2 < positions->size(); i += 3) {
    float* const p = &(*positions)[i];
    const Eigen::Vector3d at = Eigen::Vector3f(p[0], p[1], p[2]).cast<double>();
    const double hangs = at.z() - wall.by(at);
    p[2] = static_cast<float>(std::max(hangs, std::min(at.z(), tentOver(shafts, at))));
  }
}

}  // namespace vest::mesh

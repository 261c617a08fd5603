#include "vest_viz/mesh/sunken_wall.h"

#include <algorithm>
#include <cmath>

namespace vest::mesh {

void sinkWall(double sunk, const Eigen::Vector3d& lens, std::vector<float>* positions) {
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
    p[2] -= static_cast<float>(wall.by(Eigen::Vector3f(p[0], p[1], p[2]).cast<double>()));
  }
}

}  // namespace vest::mesh

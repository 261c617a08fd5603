#include "vest_viz/mesh/sunken_wall.h"

#include <algorithm>
#include <cmath>

namespace vest::mesh {

void sinkWall(double sunk, const Eigen::Vector3d& lens, std::vector<float>* positions) {
  if (!(sunk > 0) || !std::isfinite(sunk) || !lens.allFinite() || positions->size() < 3) return;
  float low = (*positions)[2], high = low;
  for (std::size_t i = 2; i < positions->size(); i += 3)
    low = std::min(low, (*positions)[i]), high = std::max(high, (*positions)[i]);
  const double middle = 0.5 * (static_cast<double>(low) + static_cast<double>(high)),
               half = static_cast<double>(high) - middle;
  if (!(half > 0)) return;
  for (std::size_t i = 0; i + 2 < positions->size(); i += 3) {
    const double above = static_cast<double>((*positions)[i + 2]) - middle;
    if (!(above > 0)) continue;
    const double share = std::min(above / half, 1.0), x = static_cast<double>((*positions)[i]) - lens.x(),
                 y = static_cast<double>((*positions)[i + 1]) - lens.y(), beside = x * x + y * y;
    const double by = sunk * share * share * (3 - 2 * share) * beside / (beside + kProp * kProp);
    (*positions)[i + 2] -= static_cast<float>(std::min(by, above));
  }
}

}  // namespace vest::mesh

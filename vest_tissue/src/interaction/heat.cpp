#include "vest_tissue/interaction/heat.h"

#include <Eigen/Core>

namespace vest::interaction {

std::vector<double> linkConductances(const std::vector<std::array<double, 3>>& position,
                                     const std::vector<double>& volume, const std::vector<HeatLink>& links,
                                     double conductivity) {
  const std::size_t knots = position.size();
  std::vector<Eigen::Matrix3d> spread(knots, Eigen::Matrix3d::Zero());
  std::vector<double> count(knots, 0.0);
  for (const HeatLink& l : links) {
    const Eigen::Vector3d a(position[l.knot0].data()), b(position[l.knot1].data());
    const Eigen::Vector3d d = b - a;
    const double squared = d.squaredNorm();
    if (!(squared > 0.0)) continue;
    for (const auto k : {l.knot0, l.knot1}) {
      spread[k] += d * d.transpose() / squared;
      count[k] += 1.0;
    }
  }
  std::vector<double> share(knots, 0.0);  // m³ per link, times the number of directions
  for (std::size_t k = 0; k < knots; ++k) {
    if (!(count[k] > 0.0)) continue;
    const double directions = count[k] * count[k] / (spread[k] * spread[k]).trace();
    share[k] = directions * volume[k] / count[k];
  }
  std::vector<double> result;
  result.reserve(links.size());
  for (const HeatLink& l : links) {
    result.push_back(l.length > 0.0 ? conductivity * (share[l.knot0] + share[l.knot1]) / (l.length * l.length)
                                    : 0.0);
  }
  return result;
}

}  // namespace vest::interaction

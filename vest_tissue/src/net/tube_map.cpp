#include "vest_tissue/net/tube_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace vest::net {
namespace {
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
}

TubeMap::TubeMap(std::vector<double> station, std::vector<std::vector<std::uint32_t>> rings,
                 std::string segment, std::size_t knots)
    : station_(std::move(station)), rings_(std::move(rings)), ring_(knots, -1), segment_(std::move(segment)) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("tube map: " + what); };
  if (station_.size() != rings_.size()) {
    refuse(std::to_string(station_.size()) + " stations for " + std::to_string(rings_.size()) +
           " rings (one each)");
  }
  for (std::size_t r = 0; r < rings_.size(); ++r) {
    if (!std::isfinite(station_[r]) || (r > 0 && !(station_[r] >= station_[r - 1]))) {
      refuse("station[" + std::to_string(r) + "]: " + std::to_string(station_[r]) +
             " (finite, ascending, m)");
    }
    for (const std::uint32_t k : rings_[r]) {
      if (k >= knots)
        refuse("rings[" + std::to_string(r) + "]: knot " + std::to_string(k) + " (0 … " +
               std::to_string(knots) + " - 1)");
      ring_[k] = static_cast<std::int32_t>(r);
    }
  }
}

double TubeMap::length() const {
  return station_.empty() ? 0.0 : station_.back() - station_.front();
}

double TubeMap::stationOf(std::uint32_t knot) const {
  const std::int32_t r = ringOf(knot);
  return r < 0 ? kNone : station_[static_cast<std::size_t>(r)];
}

double TubeMap::stationAt(const std::array<std::uint32_t, 3>& knots,
                          const std::array<double, 3>& weights) const {
  double sum = 0.0, total = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int32_t r = ringOf(knots[i]);
    if (r < 0) continue;
    sum += weights[i] * station_[static_cast<std::size_t>(r)];
    total += weights[i];
  }
  return total > 0.0 ? sum / total : kNone;
}

TubeMap::Place TubeMap::at(double station) const {
  const auto above = std::upper_bound(station_.begin(), station_.end(), station);
  if (above == station_.begin()) return {0, 0.0};
  const auto ring = static_cast<std::size_t>(above - station_.begin()) - 1;
  if (above == station_.end()) return {station_.size() - 1, 0.0};
  return {ring, (station - station_[ring]) / (station_[ring + 1] - station_[ring])};
}

std::size_t TubeMap::nearestRing(double station) const {
  const Place p = at(station);
  return p.fraction > 0.5 ? p.ring + 1 : p.ring;
}

}  // namespace vest::net

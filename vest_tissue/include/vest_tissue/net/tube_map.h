#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vest::net {

/// Tube map of one tubular object: station along the centre line <-> ring of knots <-> segment of the vessel
/// network. Built once; look-ups allocate nothing. Without rings nothing has a station.
class TubeMap {
 public:
  TubeMap() = default;
  /// @param station m, per ring, ascending @param rings knots of each ring @param segment of the vessel
  /// network, or empty
  /// @param knots how many the object has
  /// @throws std::invalid_argument: which ring or station, its value, what is allowed
  TubeMap(std::vector<double> station, std::vector<std::vector<std::uint32_t>> rings, std::string segment,
          std::size_t knots);

  std::size_t ringCount() const { return station_.size(); }
  double length() const;  ///< m, from the first to the last ring
  const std::string& segment() const { return segment_; }
  double station(std::size_t ring) const { return station_[ring]; }  ///< m
  const std::vector<std::uint32_t>& knots(std::size_t ring) const { return rings_[ring]; }
  /// Ring of a knot; -1: on none (also for knots that the object does not have).
  std::int32_t ringOf(std::uint32_t knot) const { return knot < ring_.size() ? ring_[knot] : -1; }
  /// m; NaN where the knot is on no ring.
  double stationOf(std::uint32_t knot) const;
  /// Station of a place on a triangle of knots, m: weighted by the knots that are on a ring; NaN if none is.
  double stationAt(const std::array<std::uint32_t, 3>& knots, const std::array<double, 3>& weights) const;
  /// Where a station lies: at ring + fraction (0 … 1) of the way to the next one, within the tube's ends.
  struct Place {
    std::size_t ring = 0;
    double fraction = 0.0;
  };
  Place at(double station) const;                 ///< needs ringCount() > 0
  std::size_t nearestRing(double station) const;  ///< needs ringCount() > 0

 private:
  std::vector<double> station_;
  std::vector<std::vector<std::uint32_t>> rings_;
  std::vector<std::int32_t> ring_;  ///< per knot
  std::string segment_;
};

}  // namespace vest::net

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace vest::contact {

/// Signed distance to the surface of a rigid object, on a grid; positive on the side that its triangles'
/// outside faces (for the cavity: the room). Exact at grid points within `band`, clamped to it beyond.
class DistanceGrid {
 public:
  DistanceGrid() = default;
  /// @param spacing m between grid points @param band m. @throws std::invalid_argument if more than 2^26
  /// points
  DistanceGrid(const std::vector<Eigen::Vector3d>& vertices,
               const std::vector<std::array<std::uint32_t, 3>>& triangles, double spacing, double band);

  bool empty() const { return values_.empty(); }
  double band() const { return band_; }
  double spacing() const { return spacing_; }
  /// Value at the nearest grid point, m; `band` outside the grid. Differs from distance() by at most
  /// spacing·sqrt(3)/2.
  float coarse(float x, float y, float z) const {
    const float fx = (x - origin_.x()) * inverse_ + 0.5f, fy = (y - origin_.y()) * inverse_ + 0.5f,
                fz = (z - origin_.z()) * inverse_ + 0.5f;
    if (!(fx >= 0 && fy >= 0 && fz >= 0 && fx < nx_ && fy < ny_ && fz < nz_)) return band_;
    return values_[index(static_cast<int>(fx), static_cast<int>(fy), static_cast<int>(fz))];
  }
  /// Trilinear, m, and its gradient (length about 1).
  float distance(const Eigen::Vector3f& p, Eigen::Vector3f& gradient) const;

 private:
  std::size_t index(int i, int j, int k) const { return (static_cast<std::size_t>(k) * ny_ + j) * nx_ + i; }
  std::vector<float> values_;
  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  float spacing_ = 0.0f, inverse_ = 0.0f, band_ = 0.0f;
  int nx_ = 0, ny_ = 0, nz_ = 0;
};

}  // namespace vest::contact

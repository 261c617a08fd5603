#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace vest::contact {

/// Grid spacings to both sides of a rigid object's wall within which its distance is exact (tuned).
inline constexpr double kWallBand = 5.0;

/// What a DistanceGrid of these arguments costs: its points, and how often one of them looks at a triangle.
struct GridCost {
  double points = 0, looks = 0;
};
GridCost gridCost(const std::vector<Eigen::Vector3d>& vertices,
                  const std::vector<std::array<std::uint32_t, 3>>& triangles, double spacing, double band);

}  // namespace vest::contact

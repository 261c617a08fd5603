/// What lies across an organ from a triangle, and where its skin is at home.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/base/box_tree.h"

namespace vest::scene {

class TriangleTree {
 public:
  using Triangle = std::array<std::uint32_t, 3>;

  /// Keeps both until it ends.
  TriangleTree(const std::vector<Eigen::Vector3d>& x, const std::vector<Triangle>& triangles);

  /// The first triangle that the ray from + s direction, s > 1e-6, meets from behind (`direction` looks the
  /// way that its normal does), or that it misses by less than a thousandth of its area; of several at one
  /// place the lowest.
  /// @param own is left out @returns kNoTriangle where there is none
  std::uint32_t firstBehind(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                            std::uint32_t own) const;

  /// The nearest one whose normal does not look against `normal`; 0 where there is none.
  std::uint32_t nearest(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) const;

  static constexpr std::uint32_t kNoTriangle = 0xffffffffu;

 private:
  bool looksAgainst(std::uint32_t triangle, const Eigen::Vector3d& normal) const;
  double distance(std::uint32_t triangle, const Eigen::Vector3d& p) const;

  const std::vector<Eigen::Vector3d>& x_;
  const std::vector<Triangle>& triangles_;
  std::vector<Eigen::Vector3d> centre_;
  std::vector<double> radius_;  ///< around the centre
  contact::BoxTree tree_;
};

}  // namespace vest::scene

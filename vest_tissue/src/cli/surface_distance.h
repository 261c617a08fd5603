#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace vest::tools {

struct Surface {
  std::vector<Eigen::Vector3d> points;  ///< m
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Points spread over the surface, each for the same area (vertices would count finely meshed parts more).
std::vector<Eigen::Vector3d> sampleEvenly(const Surface& surface, std::size_t about);

/// Mean distance from points spread over `from` to the triangles of `to`, m.
double meanDistance(const Surface& from, const Surface& to);

/// Rotation and shift that carries `moving` onto `still`: iterative closest point (Besl, McKay, IEEE TPAMI
/// 14(2), 1992, doi:10.1109/34.121791), both directions, started from equal centroids and axes.
Eigen::Isometry3d rigidFit(const Surface& moving, const Surface& still);

/// The gynaecology scene of this package: in the source, or where it was installed.
std::string defaultScene();

}  // namespace vest::tools

#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

/// Ways that threads are laid along: points with straight pieces between them, two at least, none twice.
namespace vest::suture {

/// m.
double lengthOf(const std::vector<Eigen::Vector3d>& curve);

/// Nodes along a way at equal distances, both ends among them.
/// @param length m: what lies behind the way's end goes straight on
/// @param segments at least 1
std::vector<Eigen::Vector3d> nodesAlong(const std::vector<Eigen::Vector3d>& curve, double length,
                                        std::size_t segments);

}  // namespace vest::suture

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Rings of a long body's surface, so that places on it have a station as those on nets of tubes. A surface
/// knot's place along the body is (a − b)/2, a and b being its ways over the surface to the knot nearest to
/// `from` and to the knot farthest from that one (Dijkstra 1959). Bins of that are the rings; their middles
/// are the centre line, and its length is the station. Knots of a ring stand in their order around it.
/// @param nodes m @param from m: at the end where station 0 is
/// @param tube its stations and rings are written; fewer than two where the body has no length to speak of
void ringsOfSurface(const std::vector<Eigen::Vector3d>& nodes,
                    const std::vector<std::array<std::uint32_t, 3>>& triangles, const Eigen::Vector3d& from,
                    TubeMap& tube);

}  // namespace vest::scene

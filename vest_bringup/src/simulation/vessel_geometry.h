#pragma once

#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

/// Rings of a scene's vessel as they lie now.
namespace vest::simulation {

inline const net::TubeMap& tubeOf(const scene::World& world, std::size_t object) {
  return world.model().objects[object].tube;
}

inline Eigen::Vector3d unit(const Eigen::Vector3d& v) {
  const double length = std::sqrt(v.squaredNorm());
  return length > 1e-12 ? Eigen::Vector3d(v / length) : Eigen::Vector3d::UnitZ();
}

Eigen::Vector3d ringCentre(const scene::World& world, std::size_t object, const net::TubeMap& tube,
                           std::size_t ring);
/// Cross-section at a ring, m²: circle of the knots' mean distance from their centre.
double crossSection(const scene::World& world, std::size_t object, const net::TubeMap& tube,
                    std::size_t ring);
/// Area within a ring, m²: also of a flat one. @param centre of the ring
double enclosed(const scene::World& world, std::size_t object, const net::TubeMap& tube, std::size_t ring,
                const Eigen::Vector3d& centre);
/// Share of a hollow vessel's circumference that a cut of `area` m² through its wall opened; 1 at most. A
/// wall of unknown thickness counts as a tenth of the radius (as in the arteries of the shipped network).
double cutShare(double area, double wall, double cross_section);

}  // namespace vest::simulation

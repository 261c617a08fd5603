#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "vest_viz/instrument/stl.h"

/// Geometry of what is neither tissue nor instrument: clips, threads, needles, slings, drops, pools, puffs.
/// World frame, metres. Bad numbers (NaN, empty, negative sizes) leave the thing concerned out.
namespace vest::effects {

/// A titanium clip, closed: two legs along z side by side in x, joined at -z. Its middle is the origin.
/// @param length m, of a leg; @param gap m, between the legs; @param wire m, radius of the wire
instrument::TriangleMesh clip(double length, double gap, double wire);
/// A round chain (thread, sling) through points. @param points x y z; @param closed joins the ends
instrument::TriangleMesh tube(const float* points, std::size_t count, double radius, bool closed);
/// A suture needle through points (m, x y z each), pointed at the first.
instrument::TriangleMesh needle(const float* points, std::size_t count, double wire_radius);
/// A ball, for knots of a thread.
instrument::TriangleMesh ball(const Eigen::Vector3d& centre, double radius);
/// Adds b, moved by X, to a.
void append(instrument::TriangleMesh* a, const instrument::TriangleMesh& b, const Eigen::Isometry3d& X);

/// Quads that face the camera, four vertices each, as ogre_media/quads.vert reads them.
struct Quads {
  std::vector<float> corners;   ///< m, world; x y z per vertex
  std::vector<float> colours;   ///< r g b per vertex; of drops: effects/drops.h
  std::vector<float> features;  ///< opacity, kind (drops) or seed (puffs), flatness (drops) or phase
  std::size_t count() const { return corners.size() / 12; }
  void clear() { corners.clear(), colours.clear(), features.clear(); }
};

/// A puff of smoke; opacity follows from density · 2 radius (Beer-Lambert with kSmokeExtinction).
void addPuff(const Eigen::Vector3d& centre, double radius, double density, double phase, std::uint32_t seed,
             const Eigen::Vector3d& eye, Quads* quads);
/// m2/kg: mass extinction of smoke in visible light; 8.7 m2/g is Mulholland & Croarkin 2000 (Fire and
/// Materials 24:227) for post-flame soot, surgical plumes are mostly droplets of water and organic matter:
/// 3 m2/g assumed.
constexpr double kSmokeExtinction = 3000.0;

/// Surface of a pool from its height field, twice as fine, with a border of one cell so that it dips below
/// the tissue.
struct Pool {
  std::vector<float> positions, normals;  ///< x y z per vertex, world
  /// Per vertex: share of blood, depth (mm; < 0 beyond the shore), speed of the waves there (m/s).
  std::vector<float> features;
  std::vector<std::uint32_t> triangles;
};
/// What a FluidPool says of its cells, row-major.
struct PoolCells {
  const float* height = nullptr;        ///< m above the origin's plane at the cell's middle, NaN where dry
  const std::uint8_t* depth = nullptr;  ///< 0.1 mm; null: unknown, kUnknownDepth
  const std::uint8_t* blood = nullptr;  ///< 0 water … 255 blood; null: everywhere as in blood_fraction
  const float* velocity = nullptr;      ///< m/s, of the surface, upwards; null: it lies still
  double blood_fraction = 1;            ///< of the whole pool, 0 … 1
};
/// A film of blood on the ground as a thin skin over it, twice as fine as its cells, with a border without
/// blood. Features: thickness (µm), share that has set, how steeply the thickness rises (µm/m), per vertex.
/// @param height m above the origin's plane, NaN: none; @param thickness µm; @param set of 255
Pool filmSurface(const Eigen::Isometry3d& origin, double cell, std::uint32_t columns, std::uint32_t rows,
                 const float* height, const std::uint8_t* thickness, const std::uint8_t* set);
constexpr float kUnknownDepth = 5.0f;  ///< mm: hides the ground where it is blood (assumed)
Pool poolSurface(const Eigen::Isometry3d& origin, double cell, std::uint32_t columns, std::uint32_t rows,
                 const PoolCells& cells);

}  // namespace vest::effects

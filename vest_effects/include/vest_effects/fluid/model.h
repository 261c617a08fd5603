#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Blood, irrigation water and their mixture: particles while they fly, splash and run over tissue, a height
/// field where they have come to rest.
///
///      source ---->  particles (position-based fluid)  ----> suction
///                     |  impact J on tissue triangles          ^
///                     v  absorbed when slow or under water     |
///                    pools (shallow water over the tissue) ----+
///
/// Volume is accounted: emitted = pending + particles + pools + films + sucked + soaked + lost + stained,
/// always.
namespace vest::fluid {

inline constexpr int kMostSources = 160;  ///< 128 of bleeding, the rest for instruments
inline constexpr int kMostSuctions = 4;
inline constexpr int kMostBubbles = 128;
inline constexpr int kMostNeighbours = 64;  ///< of a particle; about 33 lie within the kernel at rest
inline constexpr int kMostPlanes = 3;       ///< tissue triangles that hold one particle at a time
inline constexpr int kMostLensHits = 32;    ///< drops on the lens that one step tells

/// Numbers that describe the fluid and its box. Ranges are checked by the Model's builder.
struct Parameters {
  double spacing = 0.002;  ///< m: edge of the cube of fluid that one whole particle stands for, 0.5 … 10 mm
  int capacity = 2500;  ///< particles, 16 … 60000; beyond it the oldest join the pools (degraded), and from
                        ///< half of it on drops splash no more: what a step costs is bounded
  int iterations = 3;   ///< of the density constraint per step, 1 … 50
  double density = 1000.0;        ///< kg/m³ of water, 500 … 2000
  double blood_density = 1060.0;  ///< kg/m³, 500 … 2000 (Hinghofer-Szalkay 1985: 1050 … 1060); counts in what
                                  ///< is passed to tissue, not between particles or in pools (6 %)
  double water_viscosity = 0.69e-3;  ///< Pa·s at 37 °C (IAPWS 2008, doi:10.1063/1.3088050)
  double blood_viscosity = 3.5e-3;  ///< Pa·s at high shear (Merrill 1969, doi:10.1152/physrev.1969.49.4.863)
  double water_tension = 0.070;     ///< N/m at 37 °C (IAPWS 1994, doi:10.1063/1.555688)
  double blood_tension = 0.056;     ///< N/m (Hrnčíř and Rosina 1997, Physiol. Res. 46, 319–321)
  double contact_angle_cosine = 0.5;  ///< wet peritoneum, 60°: assumed
  double restitution = 0.02;          ///< epsilon_p: normal part kept in an impact; assumed
  double friction = 0.3;              ///< mu_p: tangential part lost in an impact; assumed
  double splash_share = 0.06;         ///< of an impacting particle's volume; assumed
  double splash_restitution = 0.25;   ///< normal speed of a splash over that of the impact; assumed
  double rest_time = 0.08;            ///< s: a slow particle on tissue joins the pool after it; assumed
  std::array<double, 3> low{-0.20, -0.24, -0.03};  ///< m, world: box of the domain; what leaves it is lost
  std::array<double, 3> high{0.20, 0.24, 0.25};    ///< m; each side at most 2 m
  double pool_cell = 0.004;                        ///< m: of the height field, 1 … 50 mm
};

/// How many knots and triangles a surface has; order and sizes are those of Inputs::surfaces.
struct SurfaceSize {
  std::size_t knots = 0, triangles = 0;
};

/// Immutable once built. Kernel constants are sums and products of the parameters.
struct Model {
  Parameters parameters;
  std::vector<SurfaceSize> surfaces;
  std::vector<std::size_t> first_knot;  ///< of each surface in State::knots; one entry more than surfaces
  std::size_t triangles = 0;            ///< of all surfaces
  int columns = 0, rows = 0;            ///< of the height field, along x and y
  double whole = 0;                     ///< m³: volume of a whole particle, spacing³
  float h = 0;                          ///< m: kernel radius, 2·spacing
  float density_scale = 0;   ///< of (1−r²/h²)³, so that a cubic lattice of whole particles has density 1
  float gradient_scale = 0;  ///< 1/m, of (1−r/h)²: the spiky kernel with the same density scale
  float layer_density = 0;   ///< of a whole layer, of (1−z²/h²)⁴, z m away
  float layer_slope = 0;     ///< 1/m, likewise of (z/h)(1−z/h)³
  float relaxation = 0;      ///< 1/m²: added to the constraint's denominator
  float cohesion_water = 0, cohesion_blood = 0;  ///< m/s², per whole neighbour, of Akinci's kernel
  float adhesion_water = 0, adhesion_blood = 0;  ///< m/s² at the wall
};

/// @param surfaces of the tissue, in the order of Inputs::surfaces
/// @throws std::invalid_argument naming field, value and what is allowed
Model buildModel(const Parameters& parameters, const std::vector<SurfaceSize>& surfaces);

}  // namespace vest::fluid

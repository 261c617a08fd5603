#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vest_effects/fluid/step.h"

namespace vest::fluid {

/// Four numbers that are read together.
struct alignas(16) Quad {
  float a[4];
};

/// A tissue triangle as the contact search sees it at the end of the step.
struct PlacedTriangle {
  float p0[3], p1[3], p2[3];  ///< m
  float travel[3];            ///< m: mean way of its knots in this step
  float normal[3];            ///< unit, outwards
  float before[4];            ///< unit normal and offset of its plane before the step
  std::uint16_t surface = 0;
  std::uint32_t index = 0;  ///< in its surface
  std::uint32_t id = 0;     ///< among all triangles
};

/// A plane that holds a particle: n·x >= offset + radius.
struct Plane {
  float normal[3];
  float offset;       ///< m
  float velocity[3];  ///< m/s, of the tissue there
  float weights[3];
  float distance;            ///< m, at the predicted place
  std::uint32_t placed = 0;  ///< index in ScratchData::placed
};

/// Modular grid: a cell's coordinates are taken modulo powers of two, so that it covers all space; what
/// shares a cell from afar is told apart by distance.
struct CellGrid {
  int bits_x = 6, bits_y = 5, bits_z = 5;
  float inverse = 0;  ///< 1/m
  std::vector<std::uint32_t> start;
  void shape(int bx, int by, int bz, double cell) {
    bits_x = bx, bits_y = by, bits_z = bz;
    inverse = static_cast<float>(1.0 / cell);
    start.assign((std::size_t{1} << (bx + by + bz)) + 2, 0);
  }
  static int floorInt(float v) {
    const int i = static_cast<int>(v);
    return i - (static_cast<float>(i) > v);
  }
  int coordinate(float v) const { return floorInt(v * inverse); }
  std::uint32_t row(int y, int z) const {
    const auto my = (1u << bits_y) - 1u, mz = (1u << bits_z) - 1u;
    return (((static_cast<unsigned>(z) & mz) << bits_y) | (static_cast<unsigned>(y) & my)) << bits_x;
  }
  std::uint32_t column(int x) const { return static_cast<unsigned>(x) & ((1u << bits_x) - 1u); }
  std::uint32_t cell(int x, int y, int z) const { return row(y, z) | column(x); }
};

inline constexpr std::size_t kNeighbourPadding = 8;

/// Numbers of viscosity and cohesion in this step; units as in the Model.
struct Diffusion {
  float h, gradient_scale, dt, nu_water, nu_blood, cohesion_water, cohesion_blood;
};

struct ScratchData;
/// The loops over neighbours, for particles from … to − 1, at one instruction level.
struct Kernels {
  const char* level;
  void (*lists)(const Model& m, ScratchData& s, std::size_t from, std::size_t to);
  void (*lambdas)(const Model& m, ScratchData& s, std::size_t from, std::size_t to);
  void (*corrections)(const Model& m, ScratchData& s, const std::vector<float>& volume, std::size_t from,
                      std::size_t to);
  void (*diffusions)(const Diffusion& f, ScratchData& s, std::size_t from, std::size_t to);
};
extern const Kernels kBaseline, kAvx2;
/// By the processor; the environment variable VEST_KERNEL=baseline forces that one.
const Kernels& chooseKernels();

struct ScratchData {
  int threads = 1;
  const Kernels* kernels = nullptr;
  CellGrid grid;
  std::vector<std::uint32_t> cell;   ///< per particle
  std::vector<std::uint32_t> order;  ///< sorted place -> old index
  std::vector<float> shuffle;
  std::vector<Quad> place;           ///< x, y, z and volume; later lambda
  std::vector<Quad> velocity;        ///< vx, vy, vz and blood
  std::vector<float> px, py, pz;     ///< m: where the particle began the step
  std::vector<float> inx, iny, inz;  ///< m/s: velocity before contacts and density
  std::vector<float> dx, dy, dz;     ///< m: corrections, or m/s
  std::vector<float> lambda;
  std::vector<Quad> slope;                ///< sum of the kernel's gradients over the neighbours
  std::vector<std::uint32_t> neighbours;  ///< kMostNeighbours + 8 per particle, padded to eights
  std::vector<std::uint16_t> neighbour_count;
  std::vector<Plane> planes;  ///< kMostPlanes per particle
  std::vector<std::uint8_t> plane_count;
  // Contact search.
  CellGrid tissue_grid;
  std::vector<std::uint8_t> wanted;  ///< per cell of the tissue grid
  std::vector<PlacedTriangle> placed;
  std::vector<std::uint32_t> entries;  ///< indices into `placed`, by cell
  std::size_t entry_count = 0, placed_count = 0;
  std::vector<std::array<double, 3>> momentum;       ///< per triangle, N·s
  std::vector<std::array<double, 4>> impact_weight;  ///< sum of |J|·weights and of |J|
  std::vector<std::uint32_t> touched;                ///< triangles with momentum, in order of first touch
  std::vector<std::uint8_t> is_touched;
  std::vector<std::uint32_t> triangle_offset;  ///< of each surface among all triangles
  // Pools.
  std::vector<float> face_u, face_v, share, old_surface, new_u, new_v, low_u, high_u, low_v, high_v;
};

void sortParticles(const Model& model, State& state, ScratchData& s);
void findNeighbours(const Model& model, std::size_t count, ScratchData& s);
void solveDensity(const Model& model, const State& state, ScratchData& s, float dt);
void diffuse(const Model& model, State& state, ScratchData& s, float dt);

/// Places the triangles that particles may meet and fills each particle's planes.
void findPlanes(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// Pushes particles out of tissue; momentum goes to the triangles.
void pushOut(const Model& model, const State& state, ScratchData& s, float dt);
/// Restitution, friction, splashes, adhesion.
void impact(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
void addMomentum(ScratchData& s, const PlacedTriangle& t, const float* weights, double jx, double jy,
                 double jz);

void emit(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
void suck(const Model& model, const Inputs& inputs, State& state, ScratchData& s, Report& report);
void absorb(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// One particle joins the pool under it, wherever it is. Its volume is lost where there is no bed.
void drown(const Model& model, State& state, std::size_t particle);
void renewBed(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
void stepBubbles(const Model& model, const Inputs& inputs, State& state);
void hitWindow(const Model& model, const Inputs& inputs, const State& state, Report& report);
/// Takes away what has no volume left, keeping the order.
void compact(State& state);

inline int columnOf(const Model& m, float x) {
  return CellGrid::floorInt((x - static_cast<float>(m.parameters.low[0])) /
                            static_cast<float>(m.parameters.pool_cell));
}
inline int rowOf(const Model& m, float y) {
  return CellGrid::floorInt((y - static_cast<float>(m.parameters.low[1])) /
                            static_cast<float>(m.parameters.pool_cell));
}

}  // namespace vest::fluid

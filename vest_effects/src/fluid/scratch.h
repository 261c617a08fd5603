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

/// A box along the axes; empty until something is added.
struct Extent {
  float low[3] = {1e9f, 1e9f, 1e9f}, high[3] = {-1e9f, -1e9f, -1e9f};
  void add(const float* p) {
    for (int k = 0; k < 3; ++k) {
      low[k] = low[k] < p[k] ? low[k] : p[k];
      high[k] = high[k] > p[k] ? high[k] : p[k];
    }
  }
  void grow(float by) {
    for (int k = 0; k < 3; ++k) low[k] -= by, high[k] += by;
  }
  bool meets(const Extent& o) const {
    return !(low[0] > o.high[0] || high[0] < o.low[0] || low[1] > o.high[1] || high[1] < o.low[1] ||
             low[2] > o.high[2] || high[2] < o.low[2]);
  }
};

/// A tissue triangle as the contact search sees it at the end of the step.
struct PlacedTriangle {
  float p0[3], p1[3], p2[3];  ///< m
  float travel[3];            ///< m: mean way of its knots in this step
  float normal[3];            ///< unit, outwards
  float before[4];            ///< unit normal and offset of its plane before the step
  Extent box;                 ///< m, with what it reaches
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
  float solid;               ///< share of the half space behind it that is tissue
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

/// Particles of one cell, which look for tissue together.
struct ParticleGroup {
  std::uint32_t first = 0, count = 0;
  Extent ways;                                 ///< m: of their ways in this step
  std::uint32_t first_hit = 0, hit_count = 0;  ///< in ScratchData::hits
};

/// Friction c_f of a smooth wall, tau = c_f rho u² (Chow 1959, order of).
inline constexpr float kDrag = 0.005f;

/// Triangles of a run (tuned): neighbours in a mesh mostly have neighbouring numbers.
inline constexpr std::size_t kTriangleBlock = 8;

/// Boxes around runs of a surface's triangles, kept from step to step while its knots hardly move: they only
/// save looking at triangles that are far from all particles.
struct SurfaceBlocks {
  std::size_t knots = 0, triangles = 0;
  std::vector<float> positions;                       ///< m, when the boxes were made
  std::vector<std::array<std::uint32_t, 3>> corners;  ///< likewise
  std::vector<Extent> boxes;
  Extent whole;
};

/// A surface that particles may meet in this step.
struct NearSurface {
  std::size_t surface = 0, first = 0, last = 0;  ///< its blocks in ScratchData::low …, filled up to eights
  Extent whole;                                  ///< m, with the reach of its triangles
};

inline constexpr std::size_t kNeighbourPadding = 8;

/// Numbers of the search for tissue planes: m, m, 1/s.
struct PlaneSearch {
  float reach, skin, inverse_dt;
};

/// Numbers of viscosity and cohesion in this step; units as in the Model.
struct Diffusion {
  float h, gradient_scale, dt, nu_water, nu_blood, cohesion_water, cohesion_blood;
};

/// Numbers of the pools in a part of a step, and the rectangle that holds all water: rows and columns, both
/// ends included.
struct PoolNumbers {
  float dt, dx, gravity, nu;
  std::size_t columns, r0, r1, c0, c1;
};

/// A vertical line through an instrument that may stand in a pool, and the next of the same cell.
struct ImmersedLine {
  float low, high;  ///< m, world z: where it enters and leaves
  std::int32_t next;
};
struct ImmersedCell {
  std::uint32_t cell;
  float slope;  ///< m that instruments raise the surface by, a metre of liquid more
  float depth;  ///< m, of the liquid when that was found
};

struct ScratchData;
/// The costly loops at one instruction level: over neighbours, for particles from … to − 1, and the pools.
struct Kernels {
  const char* level;
  void (*lists)(const Model& m, ScratchData& s, std::size_t from, std::size_t to);
  void (*lambdas)(const Model& m, ScratchData& s, std::size_t from, std::size_t to);
  void (*corrections)(const Model& m, ScratchData& s, const std::vector<float>& volume, std::size_t from,
                      std::size_t to);
  void (*diffusions)(const Diffusion& f, ScratchData& s, std::size_t from, std::size_t to);
  void (*meet)(ScratchData& s);  ///< of groups with blocks
  void (*planes)(const PlaneSearch& f, ScratchData& s, std::size_t from, std::size_t to);  ///< of groups
  void (*flow)(const PoolNumbers& n, ScratchData& s, Pools& pools);
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
  std::vector<float> dx, dy, dz;     ///< m: places while neighbours are sought, corrections, or m/s
  std::vector<float> lambda;
  std::vector<Quad> slope;                ///< sum of the kernel's gradients over the neighbours
  std::vector<std::uint32_t> neighbours;  ///< kMostNeighbours + 8 per particle, padded to eights
  std::vector<std::uint16_t> neighbour_count;
  std::vector<Plane> planes;        ///< kMostPlanes per particle
  std::vector<float> tissue_slope;  ///< 1/m, of each plane in the density
  std::vector<std::uint8_t> plane_count;
  // Contact search.
  std::vector<ParticleGroup> groups;
  std::vector<SurfaceBlocks> surfaces;
  std::vector<NearSurface> near;
  std::array<std::vector<float>, 3> low, high;  ///< m: boxes of their blocks with their reach
  std::vector<std::uint32_t> slot;  ///< per block: 1 + its place among those that a group meets; 0: none
  std::vector<std::uint32_t> hits;  ///< blocks that groups meet
  std::size_t group_count = 0, near_count = 0, block_count = 0, hit_count = 0, placed_blocks = 0;
  std::vector<PlacedTriangle> placed;  ///< eight per block that a group meets
  std::vector<Quad> ball;              ///< per placed triangle: middle, and how far from it a particle may be
  std::vector<Quad> facing, was;       ///< its plane after and before the step
  std::vector<std::array<double, 3>> momentum;       ///< per triangle, N·s
  std::vector<std::array<double, 5>> impact_weight;  ///< sum of |J|·weights, of |J| and of |J|²/mass
  std::vector<std::uint32_t> touched;                ///< triangles with momentum, in order of first touch
  std::vector<std::uint8_t> is_touched;
  std::vector<double> shear, stain;            ///< per triangle, N·s, m³
  std::vector<std::uint32_t> sheared;          ///< triangles with shear, in order of first touch
  std::vector<std::uint32_t> triangle_offset;  ///< of each surface among all triangles
  // Pools.
  std::vector<float> face_u, face_v, share, old_surface, new_u, new_v, low_u, high_u, low_v, high_v;
  std::vector<float> floor;  ///< m: highest upward face of rigid surfaces, per cell, or kNoBed
  std::vector<std::int32_t> floor_triangle;  ///< its index among all triangles
  bool has_floor = false;
  std::vector<std::int32_t> around, open, wave;  ///< cells: see reachUnder()
  std::vector<float> underside, sink;            ///< m: see sinkLevels()
  std::vector<float> bearing;                    ///< per cell: see findBearing()
  /// Per knot of one surface: N x y z, N·s/m, N/m, and the area (of faces under the level) times its depth
  /// and the area, for their mean
  std::vector<std::array<double, 7>> knot_load;
  std::vector<std::uint8_t> is_loaded;
  std::vector<std::uint32_t> loaded;                     ///< knots of one surface
  std::vector<ImmersedLine> lines;                       ///< of all instruments
  std::vector<std::int32_t> first_line;                  ///< per cell; -1: none
  std::vector<ImmersedCell> immersed;                    ///< cells that have lines
  int wet_r0 = 0, wet_r1 = -1, wet_c0 = 0, wet_c1 = -1;  ///< rectangle that holds all water, ends included
};

void sortParticles(const Model& model, State& state, ScratchData& s);
void findNeighbours(const Model& model, std::size_t count, ScratchData& s);
void solveDensity(const Model& model, const State& state, ScratchData& s, float dt);
void diffuse(const Model& model, State& state, ScratchData& s, float dt);

/// Hands parts of 0 … count-1 to the threads; parts do not depend on each other.
template <class F>
void parts(std::size_t count, int threads, F&& f) {
#ifdef _OPENMP
  if (threads > 1 && count > 256) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (int t = 0; t < threads; ++t) {
      const auto k = static_cast<std::size_t>(t), n = static_cast<std::size_t>(threads);
      f(count * k / n, count * (k + 1) / n);
    }
    return;
  }
#else
  (void)threads;
#endif
  f(std::size_t{0}, count);
}

/// Blocks of triangles that lie near any particle, refitted; then those that a group of particles meets are
/// placed.
void nearBlocks(const Inputs& inputs, const Extent& particles, ScratchData& s, float reach);
void placeTriangles(const Model& model, const Inputs& inputs, const State& state, ScratchData& s,
                    float reach);
/// Fills each particle's planes.
void findPlanes(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// Pushes particles out of tissue; momentum goes to the triangles.
void pushOut(const Model& model, const State& state, ScratchData& s, float dt);
/// Restitution, friction, splashes, adhesion.
void impact(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// Momentum that fluid of a mass (kg) passes to a triangle, N·s.
void addMomentum(ScratchData& s, const PlacedTriangle& t, const float* weights, double jx, double jy,
                 double jz, double mass);

/// Shear stress times area times time, N·s; > 0.
inline void addShear(ScratchData& s, std::uint32_t triangle, double impulse) {
  if (s.shear[triangle] == 0) s.sheared.push_back(triangle);
  s.shear[triangle] += impulse;
}
/// `volume` m³ of blood goes from the fluid onto a triangle.
inline void addStain(State& state, ScratchData& s, std::uint32_t triangle, double volume) {
  addShear(s, triangle, 1e-30);  // told with the shears, which are sorted
  s.stain[triangle] += volume;
  state.stained += volume;
}
/// Whether rigid ground is what a cell's liquid stands on.
inline bool onGround(const Pools& w, const ScratchData& s, std::size_t cell) {
  return w.bed[cell] > kNoBed && w.bed[cell] <= s.floor[cell];
}
/// What of the pools is too thin to flow stays on the tissue under it, as far as it is blood: on rigid ground
/// as Pools::film, which goes into liquid that comes back.
void leaveFilms(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// Pools::raised: instruments displace liquid, and its surface rises by what they take of a cell. The water
/// flows as its surface falls, so what they take counts in Pools::head.
void immerse(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// The same as the water comes and goes, within a step.
void followLevel(State& state, ScratchData& s);
/// Shear of the pools on what lies under them.
void dragPools(const Model& model, const Inputs& inputs, const State& state, ScratchData& s);

void emit(const Model& model, const Inputs& inputs, State& state);
void suck(const Model& model, const Inputs& inputs, State& state, ScratchData& s, Report& report);
void absorb(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// Instruments turn fluid away; s.px … are the places before the step.
void turnAway(const Model& model, const Inputs& inputs, State& state, const ScratchData& s);
/// Whether tissue lies below or above a particle.
bool overBed(const Model& model, const State& state, std::size_t particle);
/// One particle joins the pool below or above it, or beside that, no farther than it has come itself. Its
/// volume is lost where there is no bed.
void drown(const Model& model, State& state, std::size_t particle);
void renewBed(const Model& model, const Inputs& inputs, State& state, ScratchData& s);
/// How the pools weigh on the knots, where they stand now.
void weighPools(const Model& model, const Inputs& inputs, State& state, ScratchData& s, Report& report);
/// How much lower liquid stands that runs under tissue beside it: renews Pools::sunk.
/// ScratchData::around: what it reaches, ScratchData::underside: the lowest face over the ground there (m).
void sinkLevels(const Model& model, State& state, ScratchData& s);
inline constexpr float kStanding =
    1e-3f;  ///< m: shallower water is a film, which does not reach under tissue (assumed)
void stepBubbles(const Model& model, const Inputs& inputs, State& state);
void hitWindow(const Model& model, const Inputs& inputs, const State& state, Report& report);
/// Takes away what has no volume left, keeping the order.
void compact(State& state);

/// Mass of a whole particle of this mixture, kg.
inline double wholeMass(const Model& m, float blood) {
  const Parameters& p = m.parameters;
  return (p.density + (p.blood_density - p.density) * static_cast<double>(blood)) * m.whole;
}
inline int columnOf(const Model& m, float x) {
  return CellGrid::floorInt((x - static_cast<float>(m.parameters.low[0])) /
                            static_cast<float>(m.parameters.pool_cell));
}
inline int rowOf(const Model& m, float y) {
  return CellGrid::floorInt((y - static_cast<float>(m.parameters.low[1])) /
                            static_cast<float>(m.parameters.pool_cell));
}

}  // namespace vest::fluid

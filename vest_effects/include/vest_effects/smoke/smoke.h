#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Smoke of coagulation: a density field that is carried, thinned and drawn off, and puffs (billboards) that
/// show the same smoke by key frames. The mass of smoke is the field's; puffs are another view of it.
namespace vest::smoke {

inline constexpr int kMostPuffs = 64;
inline constexpr int kMostSources = 8;
inline constexpr int kMostSuctions = 4;
inline constexpr int kTurbulenceSide = 32;  ///< cells of the turbulence's cube, which repeats

struct Parameters {
  std::array<double, 3> low{-0.18, -0.22, 0.0};  ///< m, world: the cavity's box
  std::array<double, 3> high{0.18, 0.22, 0.20};  ///< m
  double cell = 0.0125;                          ///< m, 2 … 100 mm; at most 200,000 cells
  /// kg of particles per J into tissue: 40 mg of condensate come of 1 g of tissue (Tomita et al. 1981,
  /// doi:10.1016/0165-1218(81)90120-8), which takes 1.9 kJ to heat from 37 to 100 °C and dry (water 75 %,
  /// 2.26 kJ/g). 30 W then make 0.6 mg/s, and 45 s of it in a cubic metre 28 mg/m³; measured in a chamber:
  /// 10 to 16 (Sci. Rep. 11:14096, 2021).
  double yield = 2.1e-8;
  double rise = 0.6;        ///< m/s² of upward acceleration per g/m³ of fresh smoke; assumed
  double damping = 2.0;     ///< 1/s: of the gas's motion; assumed
  double stirring = 0.15;   ///< m/s²: random forcing of the gas where there is smoke; assumed
  double settling = 240.0;  ///< s: particles stick to walls; assumed
};

/// Immutable once built.
struct Model {
  Parameters parameters;
  int nx = 0, ny = 0, nz = 0;     ///< cells; x fastest
  std::vector<float> turbulence;  ///< kTurbulenceSide³, mean 1
};
/// @throws std::invalid_argument naming field, value and what is allowed
Model buildModel(const Parameters& parameters);

struct Puff {
  std::array<float, 3> position{};  ///< m, world
  float age = 0;                    ///< s
  float mass = 0;                   ///< kg of smoke that it shows
  std::uint32_t seed = 0;
};

/// Everything that evolves. A copy is a snapshot.
struct State {
  std::uint64_t step = 0;
  double time = 0;              ///< s
  std::vector<float> density;   ///< kg/m³ per cell
  std::vector<float> u, v, w;   ///< m/s on the cells' lower faces along x, y, z (one more at the end)
  std::vector<float> pressure;  ///< m²/s: of the last projection, where the next begins
  std::array<Puff, kMostPuffs> puffs{};
  std::uint32_t puff_count = 0, puffs_made = 0;
  double waiting = 0;                     ///< kg made since the last puff
  double since_puff = 0;                  ///< s
  double made = 0, drawn = 0, faded = 0;  ///< kg since the start: produced, sucked off, exchanged and settled
};

struct Source {
  std::array<double, 3> position{};  ///< m, world
  double energy = 0;                 ///< J into tissue in this step
};
struct Suction {
  std::array<double, 3> position{};  ///< m, world
  double flow = 0;                   ///< m³/s of gas
};
struct Inputs {
  double dt = 0.02;  ///< s, 1e-4 … 0.1
  std::uint32_t seed = 1;
  double renewal = 0;  ///< 1/s, 0 … 10: share of the gas that leaves, and its smoke with it
  /// m, world, per column (x fastest) or null: a wall that hangs into the box. No smoke is above it: what was
  /// there is pushed down.
  const float* ceiling = nullptr;
  std::array<Source, kMostSources> sources{};
  int source_count = 0;
  std::array<Suction, kMostSuctions> suctions{};
  int suction_count = 0;
};

/// Sized once; nothing in it matters between steps.
struct Scratch {
  explicit Scratch(const Model& model)
      : divergence(static_cast<std::size_t>(model.nx) * model.ny * model.nz),
        in(static_cast<std::size_t>(model.nx) * model.ny + 2),
        out(in.size()),
        colour(static_cast<std::size_t>(model.nx) + 1) {
    for (std::size_t i = 0; i < colour.size(); i += 2) colour[i] = 1;
  }
  std::vector<float> divergence;  ///< m/s per cell: what the projection has to take away
  std::vector<float> in,
      out;  ///< of a row or sheet of cells: what flows through their faces, or a row's pressures
  std::vector<std::uint32_t> colour;  ///< 1 0 1 0 …: cells that a pass of the relaxation takes
};

enum class Status : std::uint8_t { Ok = 0, BadInput = 1 };

State initialState(const Model& model);
/// kg in the field.
double mass(const Model& model, const State& state);
/// One step: forces on the gas, projection to a flow without sources but the suction (red-black relaxation),
/// donor-cell transport (mass conserved, never negative). A cavity without smoke costs nothing. Allocates and
/// throws nothing. After BadInput the State is what it was.
Status step(const Model& model, const Inputs& inputs, State& state, Scratch& scratch);

/// kg/m³ at a place, m; 0 outside.
float densityAt(const Model& model, const State& state, float x, float y, float z);
/// What a viewer draws by method 1: the density times 3-D turbulence that shifts with time; same mean.
/// @param out nx·ny·nz values, kg/m³
void drawnDensity(const Model& model, const State& state, float* out);

/// What a viewer draws of a puff by method 2: Catmull–Rom splines through key frames k0 … k5 over its life.
struct PuffLook {
  float radius = 0;   ///< m
  float density = 0;  ///< kg/m³
  float phase = 0;    ///< 0 … 1 of its life
};
PuffLook lookOf(const Puff& puff);

void save(const State& state, std::vector<std::uint8_t>& bytes);
bool restore(const Model& model, const std::uint8_t* bytes, std::size_t size, State& state);

}  // namespace vest::smoke

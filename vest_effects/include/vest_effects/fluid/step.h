#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_effects/fluid/state.h"

namespace vest::fluid {

/// One tissue surface at the end of this step. Arrays are the caller's; triangles counter-clockwise from
/// outside, where the fluid is.
struct Surface {
  const float* positions = nullptr;                         ///< m, world, x y z per knot
  const std::array<std::uint32_t, 3>* triangles = nullptr;  ///< knots
  std::size_t knot_count = 0, triangle_count = 0;           ///< at most those of the Model
  const std::uint8_t* alive = nullptr;                      ///< per triangle; null: all
  bool rigid = false;   ///< never yields: what stands on it weighs on nothing that moves
  bool closed = false;  ///< it has an inside; else it is a sheet, one side of which is told
  bool still = false;   ///< knots and triangles are those of the last step: spares looking at them
};

inline constexpr double kGreatestFlow = 1e-3;  ///< m³/s of one source: more than a heart gives

/// A jet or an ooze: Q leaves with the mean speed Q/area (continuity).
struct Source {
  int slot = 0;                      ///< 0 … kMostSources − 1: where what is not yet a particle is kept
  std::array<double, 3> position{};  ///< m, world
  std::array<double, 3> direction{0, 0, 1};  ///< any length > 0
  double area = 0;                           ///< m²; 0: oozes without speed
  double flow = 0;                           ///< m³/s, 0 … kGreatestFlow
  double blood = 1;                          ///< 0 water … 1 blood
  std::array<double, 3> velocity{};          ///< m/s, of the nozzle itself
  std::uint8_t wrung = 0;                    ///< 1: out of gauze: taken from State::soaked, not emitted anew
};

/// An open suction tip: a point sink, whose inflow has the speed Q/(4 pi r²).
struct Suction {
  std::array<double, 3> position{};  ///< m, world
  double flow = 0;                   ///< m³/s
  double reach = 0.012;              ///< m: nothing beyond it is drawn (assumed)
  double capture = 0.005;            ///< m: particles nearer than this go into it (assumed)
  double patch = 0;    ///< m: radius that gauze presses on (bleeding/swab.h); 0: it touches nothing
  bool soaks = false;  ///< gauze: counted in State::soaked, and draws nothing from afar
};

inline constexpr int kMostObstacles = 48;
/// An instrument's part, a capsule: what strikes it runs off. Fluid younger than kOwnNozzle passes: it may
/// come out of it.
struct Obstacle {
  std::array<double, 3> a{}, b{};    ///< m, world: ends of its axis
  double radius = 0;                 ///< m
  std::array<double, 3> velocity{};  ///< m/s
};
inline constexpr float kOwnNozzle = 0.010f;  ///< s: a jet of 2.5 m/s is 25 mm away then (assumed)

/// A window that drops may hit.
struct Window {
  bool present = false;
  std::array<double, 3> position{};      ///< m, world: its middle
  std::array<double, 3> axis{0, 0, 1};   ///< unit, to where it looks
  std::array<double, 3> right{1, 0, 0};  ///< unit, right in the picture
  double radius = 0.004;                 ///< m
};

struct LensHit {
  float u = 0, v = 0;  ///< place on the window, -1 … 1 to the right and down
  float volume = 0;    ///< m³ of the drop
  float blood = 0;     ///< 0 … 1
};

/// Momentum that passed to a triangle in this step, N·s, world.
struct Impact {
  std::uint16_t surface = 0;
  std::uint32_t triangle = 0;
  std::array<float, 3> weights{};
  std::array<double, 3> momentum{};
  double speed = 0;  ///< m/s: by how much the fluid changed its own velocity, mean over the momentum
};

/// Steady force of the pools on a knot.
struct KnotLoad {
  std::uint16_t surface = 0;
  std::uint32_t knot = 0;
  std::array<float, 3> force{};  ///< N, world
  float damping = 0;  ///< N·s/m: what moves under h m of water sends waves off, rho √(g h) per area
  /// N/m: what the lift under tissue loses for each metre that the knot rises, and m: how deep the knot lies
  /// below the level that lifts. Above the level (depth < 0) nothing acts yet.
  float stiffness = 0, depth = 0;
};

/// What fluid does to the film on a triangle in this step.
struct Shear {
  std::uint16_t surface = 0;
  std::uint32_t triangle = 0;
  /// N·s, whatever its direction: shear stress times area times time; c_f rho u² of drops and jets, and the
  /// drag of pools.
  double impulse = 0;
  double blood = 0;  ///< m³ that stays there: Inputs::stains
};

struct Inputs {
  double dt = 0.004;  ///< s, 1e-5 … 0.02
  std::uint32_t seed = 1;
  std::array<double, 3> gravity{0, 0, -9.81};  ///< m/s²
  std::array<Source, kMostSources> sources{};
  int source_count = 0;
  std::array<Suction, kMostSuctions> suctions{};
  int suction_count = 0;
  std::array<Obstacle, kMostObstacles> obstacles{};
  int obstacle_count = 0;
  Window window;
  const Surface* surfaces = nullptr;
  std::size_t surface_count = 0;
  /// Drops that move over tissue leave a film of blood, as thick as Landau and Levich have it (1942, Acta
  /// Physicochim. URSS 17, 42): 0.94 Ca^⅔ √(sigma/(rho g)), Ca = mu v/sigma; so does, at renew_bed, what of
  /// the pools is too thin to flow. It leaves the fluid for Report::shears.
  bool stains = false;
  double drying = 0;      ///< m/s of water that leaves a wet surface, 0 … 1e-5: gas::Condition::drying
  bool renew_bed = true;  ///< look again where the tissue lies under the pools, and tell how they weigh on it
                          ///< (costly: some 20 times a second)
};

/// Instruction level of the loops over neighbours, "baseline" or "avx2"; VEST_KERNEL=baseline forces the
/// former. Both give the same bits.
const char* kernelLevel();

enum class Status : std::uint8_t { Ok = 0, BadInput = 1 };

/// What a step tells; arrays have their room.
struct Report {
  Status status = Status::Ok;
  std::vector<Impact> impacts;  ///< at most one per triangle
  std::vector<Shear> shears;    ///< likewise
  /// Hydrostatic pressure of the pools on what yields, by surface and knot; at Inputs::renew_bed, else empty.
  /// What stands on a face weighs on it; what stands on rigid ground reaches under the tissue beside it, and
  /// lifts what dips into it there.
  std::vector<KnotLoad> loads;
  std::array<LensHit, kMostLensHits> lens{};
  int lens_count = 0;
  double sucked = 0;  ///< m³ in this step, by all that do not soak
  /// m³ that each of Inputs::suctions took in this step, and of it blood.
  std::array<double, kMostSuctions> taken{}, taken_blood{};
  std::array<double, 3> tissue_momentum{};  ///< N·s: sum over all surfaces
  int most_neighbours = 0;
};

struct ScratchData;
/// Work space, sized once; fixes the number of threads. Holds nothing that matters between steps.
class Scratch {
 public:
  explicit Scratch(const Model& model, int threads = 1);
  ~Scratch();
  Scratch(Scratch&&) noexcept;
  Scratch& operator=(Scratch&&) noexcept;
  ScratchData& data() { return *data_; }

 private:
  ScratchData* data_;
};

/// One step. Position-based fluid (Macklin and Müller 2013, doi:10.1145/2461912.2461984) with one-sided
/// density constraint; viscosity by Monaghan's operator (2005, doi:10.1088/0034-4885/68/8/R01); cohesion with
/// the kernel of Akinci, Akinci and Teschner 2013 (doi:10.1145/2508363.2508395), scaled so that the work to
/// part two half spaces is twice the surface tension; adhesion likewise to (1+cos θ)·tension (Young–Dupré).
/// Impacts with mu_p and epsilon_p; a drop splashes where We^½·Re^¼ > 57.7 (Mundo, Sommerfeld and Tropea
/// 1995, doi:10.1016/0301-9322(94)00069-V). Momentum that leaves the fluid reaches the tissue.
///
/// Allocates nothing with one thread, throws nothing; the same bits for any number of threads. After BadInput
/// the State is what it was.
void step(const Model& model, const Inputs& inputs, State& state, Scratch& scratch, Report& report);

/// Puts fluid into a pool's cell, m³ (tests, scenes). False outside the field or where there is no bed.
bool fillCell(const Model& model, State& state, int column, int row, double volume, double blood);

/// Advances the pools alone by dt (part of step()).
void stepPools(const Model& model, double gravity, double dt, State& state, Scratch& scratch);

}  // namespace vest::fluid

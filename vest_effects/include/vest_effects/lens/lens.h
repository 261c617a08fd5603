#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// The endoscope's lens: it steams up where it is colder than the dew point of the cavity, is soiled by drops
/// and smoke, and clears by warming, wiping and rinsing.
namespace vest::lens {

inline constexpr int kColumns = 32, kRows = 26;  ///< of the soiling map, over the whole picture
/// m³: a larger drop runs. A bead of 2 mm sticks to upright glass (assumed: half a drop of 2 mm).
inline constexpr float kSticks = 2.0e-9f;
inline constexpr int kMostHits = 32;
inline constexpr int kMostRuns = 12;

struct Parameters {
  double outside_temperature = 293.15;  ///< K, of the theatre; 250 … 330
  /// K of the lens at the start. 313.15: warmed beforehand, as the textbooks ask; 293.15 steams up.
  double start_temperature = 313.15;
  double heat_capacity = 2000.0;    ///< J/(m²K): 1 mm of glass and its rim (2500 kg/m³·800 J/(kg K)·1 mm)
  double heat_transfer = 12.0;      ///< W/(m²K): natural convection in a gas, 5 … 25 in textbooks
  double illumination = 15.0;       ///< W/m² that the light guide leaves in the lens; assumed
  double warming = 2500.0;          ///< W/m² of lens warming while it is on; assumed (0.2 W on a 10 mm tip)
  double blind = 0.008;             ///< kg/m² of condensate at which half of the sight is gone; assumed
  double drip = 0.05;               ///< kg/m²: more runs off (drops of some 50 µm); assumed
  double run_speed = 0.006;         ///< m/s of a drop of water that runs down the lens; assumed
  double smoke_deposition = 0.002;  ///< m/s at which smoke particles reach the lens; assumed
  double smoke_opaque = 1e-4;       ///< kg/m² of soot that blinds; assumed
  double rinse_time = 0.5, wipe_time = 0.3;  ///< s in which rinsing and wiping take 63 % away; assumed
};

/// A drop that runs down the lens.
struct Run {
  float u = 0, v = 0;  ///< −1 … 1 to the right and down on the lens
  float mass = 0;      ///< kg; 0: there is none
  float blood = 0;     ///< 0 water … 1 blood
};

/// Everything that evolves. A copy is a snapshot.
struct State {
  std::uint64_t step = 0;
  double temperature = 0;                         ///< K
  double condensate = 0;                          ///< kg/m², mean of `water`
  std::array<float, kColumns * kRows> water{};    ///< kg/m² of condensate
  std::array<float, kColumns * kRows> soiling{};  ///< 0 clean … 1 opaque
  std::array<float, kColumns * kRows> blood{};    ///< 0 water or soot … 1 blood, of what is there
  std::array<Run, kMostRuns> runs{};
};

/// A drop that hit the lens.
struct Hit {
  float u = 0, v = 0;  ///< −1 … 1 to the right and down on the lens
  float volume = 0;    ///< m³
  float blood = 0;     ///< 0 … 1
};

struct Inputs {
  double dt = 0.02;  ///< s, 1e-4 … 0.1
  std::uint32_t seed = 1;
  double temperature = 310.15, humidity = 0.95;  ///< K (250 … 340) and relative humidity of the cavity's gas
  bool outside = false;        ///< drawn back into the trocar or out: theatre air, and someone wipes it clean
  bool wiped = false;          ///< touches tissue
  float wiped_on_blood = 0;    ///< 0 … 1: how far that is covered with blood, which it takes on
  bool rinsed = false;         ///< the endoscope's own irrigation
  bool warmed = false;         ///< lens warming is on
  double smoke = 0;            ///< kg/m³ in front of it
  double lens_radius = 0.004;  ///< m: what the picture looks through
  std::array<double, 2> down{0, 1};  ///< gravity along the lens over that which pulls a drop: right, down
  std::array<Hit, kMostHits> hits{};
  int hit_count = 0;
};

enum class Status : std::uint8_t { Ok = 0, BadInput = 1 };

/// @throws std::invalid_argument naming field, value and what is allowed
void check(const Parameters& parameters);
State initialState(const Parameters& parameters);
/// One step. Water condenses a little more here than there. Where it is more than `drip`, and where a drop
/// hits that is too large to stick (kSticks), it runs down along Inputs::down: it takes the condensate on its
/// way along and leaves a streak of itself. Vapour pressure as in vapour.h; mass transfer from heat transfer
/// by Chilton and Colburn (1934) with Lewis number 0.85; implicit in the lens's temperature. Allocates and
/// throws nothing; no libm. After BadInput the State is what it was.
Status step(const Parameters& parameters, const Inputs& inputs, State& state);

double fog(const Parameters& p, const State& s);  ///< 0 clear … 1 blind, of the mean condensate
/// Likewise in a cell of the map, row-major.
double fogAt(const Parameters& p, const State& s, std::size_t cell);

void save(const State& state, std::vector<std::uint8_t>& bytes);
bool restore(const std::uint8_t* bytes, std::size_t size, State& state);

}  // namespace vest::lens

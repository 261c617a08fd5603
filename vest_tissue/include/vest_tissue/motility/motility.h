#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

/// Active deforming objects: peristalsis, dilatation, contraction.
///
///   F_i(t, k) = u_i·S_k·A_i(t)·sin(2·pi·(w_i·k/n - d_i·phase_i)),   d phase_i/dt = fr_i + frD_i·rand
///   A_i = Δp_mean,i ± Δp_var,i·rand
///
/// i = 0: u outwards from the ring's centre; i = 1: u along the centre line. k/n: the ring's place along the
/// organ. S_k: surface of the organ's rest shape that belongs to the knot, m²; in it lies the seed's 1/h. Our
/// deviations: rand is drawn once a period and the phase integrated, or it would scramble; A goes linearly
/// from one period's value to the next one's; the forces of a ring sum to zero (i = 0) and those of the organ
/// (i = 1), because an organ cannot push itself. Where the radial wave contracts, its force is that of a
/// tension around the ring, the same on a round ring: pressing a thin wall inwards would buckle it, muscle
/// does not.
namespace vest::motility {

/// One wave.
struct Wave {
  double pressure = 0.0;           ///< Pa: Δp_mean; 0: none
  double pressure_scatter = 0.0;   ///< Pa: Δp_var
  double waves = 1.0;              ///< no unit: wS, wave lengths along the organ; 0: all of it at once
  double direction = 1.0;          ///< wD: +1 travels from the first ring to the last, -1 back
  double frequency = 0.0;          ///< Hz: fr
  double frequency_scatter = 0.0;  ///< Hz: frD, added times 0 … 1
};

/// What an object of a scene says.
struct Motility {
  std::array<Wave, 2> waves;  ///< radial, axial
  double ramp = 5.0;          ///< s from the start until the full force: scenes begin at rest

  bool active() const { return waves[0].pressure != 0.0 || waves[1].pressure != 0.0; }
};

/// Presets: antrum, small_bowel, colon, uterus. Rates: 1 … 3, 8 … 11, 3 … 8 a minute (PMC8553224), 1.2 … 2.3
/// a minute (uterus: assumed). Pressures are what moves these nets, whose walls are softer than in print,
/// by a visible millimetre or less: assumed. Wave lengths: assumed.
/// False: no such word.
bool preset(std::string_view word, Motility& motility);
inline constexpr std::array<std::string_view, 4> kPresets{"antrum", "small_bowel", "colon", "uterus"};

/// What of it never changes once built.
struct MotilityModel {
  Motility waves;
  std::vector<double> area;  ///< m² per knot of the scene
};

/// State of one object.
struct MotilityState {
  std::array<double, 2> phase{};  ///< turns since the start
};

/// Pa: amplitude of a wave at a phase; `index` tells objects and waves apart, `seed` the sessions.
double amplitudeAt(const Wave& wave, double phase, std::uint32_t seed, std::uint64_t index);
/// Hz: in the period of a phase.
double frequencyAt(const Wave& wave, double phase, std::uint32_t seed, std::uint64_t index);
/// No unit, -1 … 1: the sine of the law at `place` = k/n.
double waveAt(const Wave& wave, double place, double phase);
/// No unit, 0 … 1: smooth rise over `ramp` seconds.
double rampAt(double ramp, double time);

}  // namespace vest::motility

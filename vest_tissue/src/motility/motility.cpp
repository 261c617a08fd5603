#include "vest_tissue/motility/motility.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/base/elementary.h"
#include "vest_tissue/solver/random.h"

namespace vest::motility {
namespace {

/// Draws of a period: one for the frequency, one with sign for the pressure.
double drawn(std::uint32_t seed, std::uint64_t period, std::uint64_t index) {
  return solver::randomUniform(seed, period, index);
}

double pressureOf(const Wave& w, std::uint64_t period, std::uint32_t seed, std::uint64_t index) {
  return w.pressure + w.pressure_scatter * (2.0 * drawn(seed, period, 2 * index + 1) - 1.0);
}

std::uint64_t periodOf(double phase) {
  return static_cast<std::uint64_t>(std::max(0.0, std::floor(phase)));
}

}  // namespace

bool preset(std::string_view word, Motility& m) {
  constexpr double kMinute = 60.0;
  m = Motility{};
  Wave &radial = m.waves[0], &axial = m.waves[1];
  if (word == "antrum") {
    radial = {80.0, 20.0, 1.5, 1.0, 1.0 / kMinute, 2.0 / kMinute};
    axial = {20.0, 5.0, 1.5, 1.0, 1.0 / kMinute, 2.0 / kMinute};
  } else if (word == "small_bowel") {
    radial = {60.0, 20.0, 2.0, 1.0, 8.0 / kMinute, 3.0 / kMinute};
    axial = {15.0, 5.0, 2.0, 1.0, 8.0 / kMinute, 3.0 / kMinute};
  } else if (word == "colon") {
    radial = {80.0, 30.0, 1.5, 1.0, 3.0 / kMinute, 5.0 / kMinute};
    axial = {20.0, 5.0, 1.5, 1.0, 3.0 / kMinute, 5.0 / kMinute};
  } else if (word == "uterus") {
    radial = {100.0, 30.0, 1.0, -1.0, 1.2 / kMinute, 1.1 / kMinute};  // from the cervix to the fundus
  } else {
    return false;
  }
  return true;
}

double amplitudeAt(const Wave& w, double phase, std::uint32_t seed, std::uint64_t index) {
  const std::uint64_t period = periodOf(phase);
  const double now = pressureOf(w, period, seed, index), next = pressureOf(w, period + 1, seed, index);
  return now + (phase - static_cast<double>(period)) * (next - now);
}

double frequencyAt(const Wave& w, double phase, std::uint32_t seed, std::uint64_t index) {
  return w.frequency + w.frequency_scatter * drawn(seed, periodOf(phase), 2 * index);
}

double waveAt(const Wave& w, double place, double phase) {
  return base::sineOfTurns(w.waves * place - w.direction * phase);
}

double rampAt(double ramp, double time) {
  if (!(ramp > 0.0) || time >= ramp) return 1.0;
  const double s = std::max(0.0, time / ramp);
  return s * s * (3.0 - 2.0 * s);
}

}  // namespace vest::motility

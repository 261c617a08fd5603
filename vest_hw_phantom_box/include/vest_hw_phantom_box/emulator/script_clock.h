#pragma once

#include <cstdint>
#include <optional>

namespace vest::emulator {

/// Time of a script that keeps to a simulation's: hands that go on while a slow machine falls behind would
/// meet tissue that is not there yet. Never faster than real time. Nobody told: real time.
class ScriptClock {
 public:
  static constexpr double kSilence = 3.0;  ///< s: after that without word it is real time again
  static constexpr double kAdapts = 1.0;   ///< s: time constant of coming back to the simulation's time

  /// What the simulation said.
  /// @param wall s, monotonic @param simulated s @param rate simulated over wall time, lately
  void hear(double wall, double simulated, double rate);
  /// Script time, s from 0 at the first call. @param wall s, monotonic, not before the one of the last call
  double at(double wall);

 private:
  std::optional<double> last_;    ///< s, wall: of at()
  double time_ = 0.0;             ///< s
  std::optional<double> heard_;   ///< s, wall
  double simulated_ = 0.0;        ///< s, as heard
  double rate_ = 1.0;             ///< as heard, 0 … 1
  std::optional<double> offset_;  ///< s: simulated time less script time, when they were set side by side
};

}  // namespace vest::emulator

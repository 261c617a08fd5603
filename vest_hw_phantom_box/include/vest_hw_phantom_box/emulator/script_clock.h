#pragma once

#include <optional>

namespace vest::emulator {

/// Time of a script that follows a simulation: hands that go on while a slow machine falls behind would meet
/// tissue that is not there yet. Never faster than real time; real time until it has heard of a simulation.
class ScriptClock {
 public:
  /// s that hands may be ahead, and may move at once: messages come in heaps, and tissue follows hands by as
  /// much (assumed).
  static constexpr double kLead = 0.05;
  /// s that hands may be behind and still make good while the simulation stands: it catches up 0.25 s at once
  /// (scene::RunnerOptions), and ticks come up to 0.1 s late. What is more is given up: hands would be too
  /// fast for a simulation that is slow again.
  static constexpr double kBehind = 0.3;

  /// @param simulated s, of a simulation; less than before: it begins again
  void hear(double simulated);
  /// Script time, s from 0 at the first call. @param wall s, monotonic, not before that of the last call
  double at(double wall);

 private:
  std::optional<double> last_;       ///< s, wall: of at()
  std::optional<double> simulated_;  ///< s, as heard last
  double time_ = 0.0;                ///< s
  double offset_ = 0.0;              ///< s: simulated time less script time, when they were set side by side
};

}  // namespace vest::emulator

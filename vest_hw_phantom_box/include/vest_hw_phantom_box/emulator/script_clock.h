#pragma once

#include <optional>

namespace vest::emulator {

/// Time of a script that follows a simulation: hands that go on while a slow machine falls behind would meet
/// tissue that is not there yet. What counts is how fast hands move to tissue: never faster than real time.
/// Real time until it has heard of a simulation.
class ScriptClock {
 public:
  /// s that hands may be ahead, and may move while nothing is heard: messages come in heaps, and tissue
  /// follows hands by as much (assumed).
  static constexpr double kLead = 0.05;
  /// s that hands may be behind: ticks come up to 0.1 s late (assumed). What is more stays a lag: made good,
  /// hands would be too fast.
  static constexpr double kBehind = 0.15;

  /// @param simulated s, of a simulation; less than before: it begins again
  void hear(double simulated);
  /// Script time, s from 0 at the first call. @param wall s, monotonic, not before that of the last call
  double at(double wall);

 private:
  std::optional<double> last_;       ///< s, wall: of at()
  std::optional<double> simulated_;  ///< s, as heard last
  double time_ = 0.0;                ///< s
  double told_ = 0.0;                ///< s, script time when it was heard that the simulation went on
  double offset_ = 0.0;              ///< s: simulated time less script time, when they were set side by side
};

}  // namespace vest::emulator

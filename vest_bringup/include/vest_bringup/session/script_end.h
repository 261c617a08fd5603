#pragma once

#include <algorithm>
#include <atomic>

namespace vest::session {

/// When a session that plays a script is over: the script and the exercise have ended. Told by one thread,
/// asked by another. All times are simulated ones, s, of what is recorded by then.
class ScriptEnd {
 public:
  /// s: the result and the steps that it is of come by different ways (assumed).
  static constexpr double kTail = 1.0;
  /// s that an exercise may go on behind its script: a last condition holds for some time (assumed).
  static constexpr double kPatience = 5.0;

  void scriptEnded(double simulated) { script_ = simulated; }
  void exerciseEnded(double simulated) { exercise_ = simulated; }
  bool over(double simulated) const {
    const double script = script_, exercise = exercise_;
    if (script < 0) return false;
    return simulated >= (exercise < 0 ? script + kPatience : std::max(script, exercise) + kTail);
  }

 private:
  std::atomic<double> script_{-1}, exercise_{-1};  ///< negative: not yet
};

/// Which picture is that of a moment: of its own time. A view that is starved sends none for seconds, and
/// what came before shows something else.
class PictureMoment {
 public:
  static constexpr double kLate = 0.5;  ///< s that the picture may be of later (assumed)
  static constexpr double kWait = 2.0;  ///< s that a picture may take to come (assumed)
  enum class Answer { Wait, Keep, Missed };

  /// @param moment s, system clock
  explicit PictureMoment(double moment = 0) : moment_(moment) {}
  /// @param now s, system clock @param stamp s, likewise: what the newest picture shows
  Answer look(double now, double stamp) const {
    if (stamp >= moment_ && stamp <= moment_ + kLate) return Answer::Keep;
    return stamp > moment_ || now > moment_ + kWait ? Answer::Missed : Answer::Wait;
  }

 private:
  double moment_;
};

}  // namespace vest::session

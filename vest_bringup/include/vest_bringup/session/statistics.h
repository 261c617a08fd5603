#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace vest::session {

/// What session.json says about the flow of time; from step numbers and stamps alone.
class StepStatistics {
 public:
  /// @param step number of the step  @param dt s, simulated  @param stamp s, when it was consumed
  /// @param jumps the State was set before this step (reset, load, restore): its number starts anew
  void add(std::uint64_t step, double dt, double stamp, bool jumps);

  std::uint64_t steps() const { return steps_; }
  std::uint64_t skipped() const { return skipped_; }  ///< numbers that are missing between two steps
  std::uint64_t lastStep() const { return last_step_; }
  double simulated() const { return simulated_; }                 ///< s
  double duration() const { return last_stamp_ - first_stamp_; }  ///< s, wall time
  /// Simulated over wall time, no unit; NaN before two steps.
  double realTimeFactor() const;
  /// The same in the worst whole second that begins at a tenth of a second after the first step; NaN before 1
  /// s.
  double worstSecond() const;

 private:
  std::uint64_t steps_ = 0, skipped_ = 0, last_step_ = 0;
  double first_stamp_ = 0, last_stamp_ = 0, simulated_ = 0, first_dt_ = 0;
  std::vector<double> tenths_;  ///< s, simulated in each tenth of a second
};

/// Count, first and last arrival of a topic.
struct TopicStatistics {
  std::uint64_t count = 0;
  double first = 0, last = 0;  ///< s
  std::uint32_t sequence = 0;
  void add(double stamp) {
    if (count++ == 0) first = stamp;
    last = stamp;
  }
  /// A message of a topic of which some are left out. @param number its own among those that were sent
  void add(double stamp, std::uint32_t number) {
    const std::uint64_t sent = count > 0 && number > sequence ? number - sequence : 1;
    add(stamp);
    count += sent - 1;
    sequence = number;
  }
  double rate() const {
    return count > 1 && last > first ? static_cast<double>(count - 1) / (last - first) : 0.0;
  }
};

/// An event as session.json lists it.
struct EventLine {
  std::uint64_t step = 0;
  double time = 0;  ///< s since the first step
  std::string kind, instrument, object;
  double force = 0;  ///< N
};

/// The system clock was set while the session was recorded.
struct ClockJumpLine {
  std::uint64_t step = 0;  ///< last one before it
  double time = 0;         ///< s since the first step, by the steady clock
  double by = 0;           ///< s
};

/// All of session.json.
struct Summary {
  std::string version, scene, scene_hash, state_hash, ended;
  std::uint64_t state_hash_step = 0;
  StepStatistics steps;
  std::map<std::string, TopicStatistics> topics;
  std::vector<EventLine> events;
  std::vector<ClockJumpLine> clock_jumps;
  std::uint64_t messages = 0, dropped = 0, bytes = 0;
  bool disk_full = false;
  std::vector<std::string> pictures;
};

/// session.json as text. Numbers as JSON wants them in any locale.
std::string toJson(const Summary& summary);

/// Writes DIRECTORY/session.json, under another name first: who waits for it finds it whole. False: it cannot
/// be written.
bool writeSummary(const Summary& summary, const std::string& directory);

}  // namespace vest::session

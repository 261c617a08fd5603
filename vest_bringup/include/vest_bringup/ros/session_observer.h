#pragma once

#include <functional>
#include <string>

#include "vest_bringup/ros/bag_reader.h"
#include "vest_bringup/session/statistics.h"

namespace vest::session {

/// The beginning of a vest_msgs/StepInput.
struct StepHead {
  std::uint64_t step = 0;
  double dt = 0;     ///< s
  double stamp = 0;  ///< s
  std::uint8_t command = 0;
};

/// The beginning of a vest_msgs/TissueTopology.
struct TopologyHead {
  std::uint32_t revision = 0;
  std::uint64_t step = 0;
  std::string scene, scene_hash;
};

/// Gathers what session.json says from a session's messages: while they are recorded, and again from what a
/// killed recorder left.
class SessionObserver {
 public:
  /// A stamp (s, system clock) as if the clock had never been set.
  using Line = std::function<double(double stamp)>;

  /// @param ns namespace of the session, with slashes around it
  explicit SessionObserver(const std::string& ns);

  /// Whether observe() looks into messages of this topic.
  bool wants(const std::string& topic) const;
  /// A message of a topic that it wants. One of another type than the topic's is no part of the session.
  /// @param time s, when it was recorded, on the line
  void observe(const BagMessage& message, double time, const Line& line);
  /// Any message of a bag: counts and rates; of thinned topics those that were sent.
  void count(const BagMessage& message);

  Summary summary;

 private:
  std::string ns_, step_topic_, events_topic_, topology_topic_, hash_topic_, marks_topic_;
};

/// False where the message is no StepInput.
bool readStepHead(const BagMessage& message, StepHead& head);

/// Likewise for a TissueTopology.
bool readTopologyHead(const BagMessage& message, TopologyHead& head);

/// Seconds by which a message of session/marks says that the system clock was set; false: it says none.
bool readClockMark(const BagMessage& message, double& by);

/// Sums of the jumps of the system clock: 0 before the first, …, after the last. A stamp is on the line by
/// whichever brings it nearest to the time at which it was recorded: bags' times never jump.
class ClockTotals {
 public:
  void add(double by) { totals_.push_back(totals_.back() + by); }
  double onLine(double stamp, double recorded) const;

 private:
  std::vector<double> totals_{0.0};
};

}  // namespace vest::session

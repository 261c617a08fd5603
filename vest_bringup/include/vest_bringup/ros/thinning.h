#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "vest_bringup/ros/bag_reader.h"

namespace vest::session {

/// How often a recording keeps a topic, Hz; 0: every message. Thinned is what re-simulation of `step_inputs`
/// makes again to the bit. @param topic relative to the launch namespace
double keptRate(const std::string& topic);

/// Sequence number of a message that begins with a std_msgs/Header: tells how many were sent of a topic that
/// was thinned. 0: too short
std::uint32_t sequenceOf(const BagMessage& message);

/// Which messages of the thinned topics a recording keeps.
class Thinning {
 public:
  /// @param ns namespace of the session, with slashes around it  @param state_rate Hz, of tissue/state
  Thinning(const std::string& ns, double state_rate);

  /// Whether keeps() has to be asked.
  bool wants(const std::string& topic) const { return topics_.count(topic) > 0; }
  /// @param message of a topic that it wants  @param time s, when it came, as if the system
  /// clock had never been set
  bool keeps(const BagMessage& message, double time);

 private:
  struct Topic {
    double period;    ///< s
    double next = 0;  ///< s
  };
  bool hasNews(const BagMessage& message);

  std::map<std::string, Topic> topics_;
  std::string topology_topic_, scene_;  ///< hash of the scene of the topology that was kept last
  std::uint64_t step_ = 0;
  std::uint32_t revision_ = 0;
};

}  // namespace vest::session

#include "vest_bringup/ros/thinning.h"

#include <cstring>

#include <vest_msgs/TissueState.h>

#include "vest_bringup/ros/session_observer.h"

namespace vest::session {
namespace {

struct KeptRate {
  const char* topic;
  double rate;  ///< Hz
};
constexpr KeptRate kKeptRates[] = {{"tissue/state", 10},
                                   {"tissue/contacts", 50},
                                   {"tissue/topology", 1.0 / 60},
                                   {"joint_states", 100},
                                   {"phantom_box/joint_states", 100},
                                   {"effects/haemodynamics", 50},
                                   {"left/measured_js", 50},
                                   {"left/measured_cp", 50},
                                   {"right/measured_js", 50},
                                   {"right/measured_cp", 50},
                                   {"third/measured_js", 50},
                                   {"third/measured_cp", 50},
                                   {"endoscope/measured_js", 50},
                                   {"endoscope/measured_cp", 50},
                                   {"effects/fluid", 10},
                                   {"effects/smoke", 10},
                                   {"effects/lens", 10}};

/// Whether a TissueState has fields per knot: it tells what no other state does.
bool hasFields(const BagMessage& message) {
  if (message.connection.md5sum != ros::message_traits::md5sum<vest_msgs::TissueState>()) return false;
  std::uint32_t frame = 0, positions = 0, fields = 0;
  const auto read = [&](std::size_t at, std::uint32_t& to) {
    if (at + sizeof to > message.size) return false;
    std::memcpy(&to, message.data + at, sizeof to);
    return true;
  };
  // sequence, stamp, frame; revision, step, time; positions; fields
  if (!read(12, frame) || !read(36 + std::size_t{frame}, positions)) return false;
  return read(40 + std::size_t{frame} + sizeof(float) * std::size_t{positions}, fields) && fields > 0;
}

}  // namespace

double keptRate(const std::string& topic) {
  for (const KeptRate& kept : kKeptRates)
    if (topic == kept.topic) return kept.rate;
  return 0;
}

std::uint32_t sequenceOf(const BagMessage& message) {
  std::uint32_t sequence = 0;
  if (message.size >= sizeof sequence) std::memcpy(&sequence, message.data, sizeof sequence);
  return sequence;
}

Thinning::Thinning(const std::string& ns, double state_rate) : topology_topic_(ns + "tissue/topology") {
  for (const KeptRate& kept : kKeptRates) topics_[ns + kept.topic] = {1 / kept.rate};
  topics_[ns + "tissue/state"].period = 1 / state_rate;
}

bool Thinning::hasNews(const BagMessage& message) {
  if (message.connection.topic != topology_topic_) return hasFields(message);
  TopologyHead head;
  if (!readTopologyHead(message, head)) return true;
  const bool news = head.revision != revision_ || head.scene_hash != scene_ || head.step < step_;
  revision_ = head.revision;
  scene_ = head.scene_hash;
  step_ = head.step;
  return news;
}

bool Thinning::keeps(const BagMessage& message, double time) {
  Topic& topic = topics_.at(message.connection.topic);
  const bool news = hasNews(message);
  const double early = topic.next - time;  // more than its period: time went back
  if (!news && early > 0 && early <= topic.period) return false;
  // In step with the wished rate however unevenly they come; after a pause, or news, from here.
  const bool regular = !news && early <= 0 && -early < topic.period;
  topic.next = regular ? topic.next + topic.period : time + 0.9 * topic.period;
  return true;
}

}  // namespace vest::session

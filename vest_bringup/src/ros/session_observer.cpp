#include "vest_bringup/ros/session_observer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <vest_msgs/StateHash.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/StringStamped.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueTopology.h>

#include "vest_bringup/ros/thinning.h"
#include "vest_bringup/ros/typed_message.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/scene/event_words.h"

namespace vest::session {
namespace {

constexpr std::size_t kMostEvents = 100000;

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

template <class M>
bool is(const BagMessage& message) {
  return message.connection.type == ros::message_traits::datatype<M>() &&
         message.connection.md5sum == ros::message_traits::md5sum<M>();
}

/// Reads one after another; false for ever once there is not enough left.
class Head {
 public:
  explicit Head(const BagMessage& message) : at_(message.data), end_(message.data + message.size) {}
  template <class T>
  bool take(T& to) {
    if (static_cast<std::size_t>(end_ - at_) < sizeof to) return false;
    std::memcpy(&to, at_, sizeof to);
    at_ += sizeof to;
    return true;
  }
  bool take(std::string& to) {
    std::uint32_t size = 0;
    if (!take(size) || size > static_cast<std::size_t>(end_ - at_)) return false;
    to.assign(reinterpret_cast<const char*>(at_), size);
    at_ += size;
    return true;
  }
  /// Of a std_msgs/Header. @param stamp s
  bool takeHeader(double& stamp) {
    std::uint32_t sequence = 0, seconds = 0, nanoseconds = 0;
    std::string frame;
    if (!take(sequence) || !take(seconds) || !take(nanoseconds) || !take(frame)) return false;
    stamp = seconds + 1e-9 * nanoseconds;
    return true;
  }

 private:
  const std::uint8_t *at_, *end_;
};

}  // namespace

bool readStepHead(const BagMessage& message, StepHead& head) {
  Head in(message);
  std::uint32_t seed = 0;
  return is<vest_msgs::StepInput>(message) && in.takeHeader(head.stamp) && in.take(head.step) &&
         in.take(head.dt) && in.take(seed) && in.take(head.command);
}

bool readTopologyHead(const BagMessage& message, TopologyHead& head) {
  Head in(message);
  double stamp = 0;
  return is<vest_msgs::TissueTopology>(message) && in.takeHeader(stamp) && in.take(head.revision) &&
         in.take(head.step) && in.take(head.scene) && in.take(head.scene_hash);
}

bool readClockMark(const BagMessage& message, double& by) {
  Head in(message);
  double stamp = 0;
  std::string text;
  if (!is<vest_msgs::StringStamped>(message) || !in.takeHeader(stamp) || !in.take(text)) return false;
  static const std::string kBegin = "system clock set by ";
  if (text.rfind(kBegin, 0) != 0) return false;
  const std::size_t end = text.rfind(" s");
  return end != std::string::npos && end + 2 == text.size() && end >= kBegin.size() &&
         files::parseNumber(text.substr(kBegin.size(), end - kBegin.size()), by);
}

double ClockTotals::onLine(double stamp, double recorded) const {
  double best = stamp;
  for (const double total : totals_)
    if (std::abs(stamp - total - recorded) < std::abs(best - recorded)) best = stamp - total;
  return best;
}

SessionObserver::SessionObserver(const std::string& ns)
    : ns_(ns),
      step_topic_(ns + "step_inputs"),
      events_topic_(ns + "tissue/events"),
      topology_topic_(ns + "tissue/topology"),
      hash_topic_(ns + "tissue/state_hash"),
      marks_topic_(ns + "session/marks") {}

void SessionObserver::count(const BagMessage& message) {
  const std::string& topic = message.connection.topic;
  TopicStatistics& statistics = summary.topics[topic];
  const bool thinned = topic.rfind(ns_, 0) == 0 && keptRate(topic.substr(ns_.size())) > 0;
  thinned ? statistics.add(message.time(), sequenceOf(message)) : statistics.add(message.time());
}

bool SessionObserver::wants(const std::string& topic) const {
  return topic == step_topic_ || topic == events_topic_ || topic == topology_topic_ || topic == hash_topic_;
}

void SessionObserver::observe(const BagMessage& message, double time, const Line& line) {
  const std::string& topic = message.connection.topic;
  if (topic == step_topic_) {
    StepHead head;
    if (!readStepHead(message, head)) return;
    summary.steps.add(head.step, head.dt, line(head.stamp), head.command != 0);
  } else if (topic == events_topic_) {
    vest_msgs::TissueEvent e;
    if (summary.events.size() >= kMostEvents || !is<vest_msgs::TissueEvent>(message)) return;
    try {
      readMessage("", message, e);
    } catch (const std::invalid_argument&) {
      return;
    }
    const auto steps = summary.topics.find(step_topic_);
    const double first = steps != summary.topics.end() ? steps->second.first : time;
    summary.events.push_back({e.step, line(e.header.stamp.toSec()) - first, scene::eventKey(e.kind),
                              e.instrument, e.object, e.force});
  } else if (topic == hash_topic_) {
    Head in(message);
    double stamp = 0;
    std::uint64_t step = 0, hash = 0;
    if (!is<vest_msgs::StateHash>(message) || !in.takeHeader(stamp) || !in.take(step) || !in.take(hash))
      return;
    summary.state_hash = hex(hash);
    summary.state_hash_step = step;
  } else if (topic == topology_topic_) {
    TopologyHead head;
    if (!readTopologyHead(message, head)) return;
    summary.scene = head.scene;
    summary.scene_hash = head.scene_hash;
  }
}

}  // namespace vest::session

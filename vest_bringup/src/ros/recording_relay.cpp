#include "vest_bringup/ros/recording_relay.h"

#include <chrono>
#include <cstring>

#include <geometry_msgs/PoseStamped.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/FluidState.h>
#include <vest_msgs/HaemodynamicsState.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/LensState.h>
#include <vest_msgs/SmokeState.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/SurfaceBleeding.h>

namespace vest::session {
namespace {

constexpr std::chrono::milliseconds kPeriod{20};
constexpr std::uint32_t kWaitingMessages = 8000;  // of one topic: 8 s at 1 kHz
constexpr std::uint32_t kWaitingBatches = 500;    // 10 s

/// visit.operator()<Message>(name) for each relayed topic: the one list of them.
template <class Visitor>
void eachRelayed(Visitor&& visit) {
  visit("step_inputs", vest_msgs::StepInput());
  visit("joint_states", sensor_msgs::JointState());
  visit("phantom_box/joint_states", sensor_msgs::JointState());
  visit("phantom_box/footswitches", sensor_msgs::Joy());
  visit("tissue/instruments", vest_msgs::InstrumentStates());
  visit("tissue/contacts", vest_msgs::ContactModels());
  visit("effects/haemodynamics", vest_msgs::HaemodynamicsState());
  visit("effects/surface", vest_msgs::SurfaceBleeding());
  visit("effects/fluid", vest_msgs::FluidState());
  visit("effects/smoke", vest_msgs::SmokeState());
  visit("effects/lens", vest_msgs::LensState());
  for (const char* arm : {"left", "right", "third", "endoscope"}) {
    visit(std::string(arm) + "/measured_js", sensor_msgs::JointState());
    visit(std::string(arm) + "/measured_cp", geometry_msgs::PoseStamped());
  }
}

}  // namespace

struct RecordingRelay::Topic {
  std::string name;
  const char *datatype, *md5sum, *definition;
  ros::SubscribeOptions subscription;
};

std::vector<std::string> relayedTopics() {
  std::vector<std::string> names;
  eachRelayed([&](const std::string& name, const auto&) { names.push_back(name); });
  return names;
}

RecordingRelay::RecordingRelay(ros::NodeHandle nh) : nh_(nh) {
  eachRelayed([this](const std::string& name, const auto& message) {
    relay<std::decay_t<decltype(message)>>(nh_.resolveName(name));
  });
  const auto came = [this](const ros::SingleSubscriberPublisher&) { listener_came_ = true; };
  auto options = ros::AdvertiseOptions::create<vest_msgs::RecordingBatch>(
      "session/batches", kWaitingBatches, came, ros::SubscriberStatusCallback(), ros::VoidConstPtr(),
      &queue_);
  publisher_ = nh_.advertise(options);
  thread_ = std::thread([this] { loop(); });
}

RecordingRelay::~RecordingRelay() {
  stop_ = true;
  thread_.join();
}

// By its own type a message of this process comes as a pointer; as a ShapeShifter roscpp would serialise it
// at once and wake its poll thread for it.
template <class M>
void RecordingRelay::relay(const std::string& name) {
  namespace traits = ros::message_traits;
  const auto index = static_cast<std::uint16_t>(topics_.size());
  Topic topic{name, traits::datatype<M>(), traits::md5sum<M>(), traits::definition<M>(), {}};
  boost::function<void(const ros::MessageEvent<M const>&)> callback =
      [this, index](const ros::MessageEvent<M const>& event) {
        append(index, *event.getConstMessage(), event.getReceiptTime());
      };
  topic.subscription.initByFullCallbackType<const ros::MessageEvent<M const>&>(name, kWaitingMessages,
                                                                               callback);
  topic.subscription.callback_queue = &queue_;
  topics_.push_back(std::move(topic));
  sequences_.push_back(0);
}

template <class M>
void RecordingRelay::append(std::uint16_t topic, const M& message, const ros::Time& receipt) {
  const std::size_t begin = batch_.data.size();
  const std::uint32_t size = ros::serialization::serializationLength(message);
  batch_.data.resize(begin + size);
  ros::serialization::OStream out(batch_.data.data() + begin, size);
  ros::serialization::serialize(out, message);
  // As roscpp numbers what it sends itself.
  std::uint32_t& sequence = sequences_[topic];
  if (ros::message_traits::hasHeader<M>() && size >= sizeof sequence)
    std::memcpy(batch_.data.data() + begin, &++sequence, sizeof sequence);
  batch_.topics.push_back(topic);
  batch_.receipts.push_back(receipt);
  batch_.ends.push_back(static_cast<std::uint32_t>(batch_.data.size()));
}

void RecordingRelay::loop() {
  while (!stop_) {
    std::this_thread::sleep_for(kPeriod);
    queue_.callAvailable(ros::WallDuration(0));
    if (publisher_.getNumSubscribers() == 0) {
      subscribers_.clear();
    } else if (subscribers_.empty()) {
      for (Topic& topic : topics_) subscribers_.push_back(nh_.subscribe(topic.subscription));
    }
    send();
  }
}

void RecordingRelay::send() {
  if (listener_came_) {
    listener_came_ = false;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      batch_.described.push_back(static_cast<std::uint16_t>(i));
      batch_.names.push_back(topics_[i].name);
      batch_.datatypes.push_back(topics_[i].datatype);
      batch_.md5sums.push_back(topics_[i].md5sum);
      batch_.definitions.push_back(topics_[i].definition);
    }
  }
  if (batch_.topics.empty() && batch_.described.empty()) return;
  batch_.header.stamp = ros::Time::now();
  batch_.first = count_;
  count_ += batch_.topics.size();
  publisher_.publish(batch_);
  batch_.described.clear();
  batch_.names.clear();
  batch_.datatypes.clear();
  batch_.md5sums.clear();
  batch_.definitions.clear();
  batch_.topics.clear();
  batch_.receipts.clear();
  batch_.ends.clear();
  batch_.data.clear();
}

std::uint64_t RelayInlet::take(const vest_msgs::RecordingBatch& batch, const Callback& callback) {
  const std::size_t described = batch.described.size();
  if (batch.names.size() == described && batch.datatypes.size() == described &&
      batch.md5sums.size() == described && batch.definitions.size() == described) {
    for (std::size_t i = 0; i < described; ++i) {
      kinds_[batch.described[i]] = {batch.names[i], batch.datatypes[i], batch.md5sums[i],
                                    batch.definitions[i]};
    }
  }
  const std::uint64_t lost = begun_ && batch.first > next_ ? batch.first - next_ : 0;
  next_ = batch.first + batch.topics.size();
  std::size_t begin = 0;
  for (std::size_t i = 0; i < batch.topics.size(); ++i) {
    if (i >= batch.receipts.size() || i >= batch.ends.size()) break;
    const std::size_t end = batch.ends[i];
    if (end < begin || end > batch.data.size()) break;  // not one of the relay's
    const auto kind = kinds_.find(batch.topics[i]);
    if (kind != kinds_.end()) {
      begun_ = true;
      const auto message = boost::make_shared<topic_tools::ShapeShifter>();
      message->morph(kind->second.md5sum, kind->second.datatype, kind->second.definition, "");
      // IStream reads only, but asks for memory that may be written.
      ros::serialization::IStream in(const_cast<std::uint8_t*>(batch.data.data()) + begin,
                                     static_cast<std::uint32_t>(end - begin));
      if (end > begin) message->read(in);  // it copies to null where there is nothing
      callback(kind->second.topic, batch.receipts[i], message);
    }
    begin = end;
  }
  return lost;
}

}  // namespace vest::session

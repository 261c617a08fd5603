#include "vest_bringup/ros/field_publisher.h"

#include <chrono>

#include <pthread.h>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <boost/make_shared.hpp>

#include "vest_tissue/ros/parameters.h"

namespace vest::ros_shell {

simulation::FieldOptions fieldOptions(const ros::NodeHandle& nh) {
  simulation::FieldOptions o;
  simulation::eachNumber(o, [&](const char* name, double& to, double low, double high) {
    to = doubleParameter(nh, name, to, low, high);
  });
  o.fluid.capacity = intParameter(nh, "fluid/capacity", o.fluid.capacity, 16, 60000);
  o.fluid.iterations = intParameter(nh, "fluid/iterations", o.fluid.iterations, 1, 50);
  o.threads = intParameter(nh, "fluid/threads", o.threads, 1, 64);
  return o;
}

FieldPublisher::FieldPublisher(ros::NodeHandle nh) : nh_(nh) {
  fluid_ = nh_.advertise<vest_msgs::FluidState>("effects/fluid", 10);
  smoke_ = nh_.advertise<vest_msgs::SmokeState>("effects/smoke", 10);
  lens_ = nh_.advertise<vest_msgs::LensState>("effects/lens", 10);
  impacts_ = nh_.advertise<vest_msgs::Impacts>("effects/impacts", 100);
  diagnostics_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  thread_ = std::thread([this] { loop(); });
}

FieldPublisher::~FieldPublisher() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void FieldPublisher::show(std::shared_ptr<simulation::FieldFrames> frames) {
  std::lock_guard<std::mutex> lock(mutex_);
  frames_ = std::move(frames);
}

void FieldPublisher::loop() {
  pthread_setname_np(pthread_self(), "vest_effects");
  double due = 0;
  while (!stop_) {
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    std::shared_ptr<simulation::FieldFrames> frames;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      frames = frames_;
    }
    if (!frames || !frames->update()) continue;
    const auto steady = std::chrono::duration_cast<std::chrono::nanoseconds>(
                            std::chrono::steady_clock::now().time_since_epoch())
                            .count();
    const simulation::FieldFrame& frame = frames->front();
    const ros::Time now = ros::Time::now();
    const double age = 1e-9 * static_cast<double>(steady - frame.steady_ns);
    publish(frame, now.toSec() > age ? now - ros::Duration(age) : now);
    degraded_ |= frame.degraded;
    const double t = 1e-9 * static_cast<double>(steady);
    if (t < due) continue;
    due = t + 1.0;
    diagnose(frame);
    degraded_ = false;
  }
}

void FieldPublisher::publish(const simulation::FieldFrame& frame, const ros::Time& stamp) {
  // Nodelets of the same process get the message itself: one of its own each time.
  const auto send = [&](auto message, ros::Publisher& to) {
    toMsg(frame, *message);
    message->header.stamp = stamp;
    to.publish(message);
  };
  if (fluid_.getNumSubscribers() > 0) send(boost::make_shared<vest_msgs::FluidState>(), fluid_);
  if (smoke_.getNumSubscribers() > 0) send(boost::make_shared<vest_msgs::SmokeState>(), smoke_);
  if (lens_.getNumSubscribers() > 0) send(boost::make_shared<vest_msgs::LensState>(), lens_);
  if (impacts_.getNumSubscribers() > 0 && !frame.impacts.empty())
    send(boost::make_shared<vest_msgs::Impacts>(), impacts_);
}

void FieldPublisher::diagnose(const simulation::FieldFrame& frame) {
  diagnostic_msgs::DiagnosticArray msg;
  msg.header.stamp = ros::Time::now();
  msg.status.resize(1);
  diagnostic_msgs::DiagnosticStatus& status = msg.status[0];
  status.name = "vest: operating field";
  status.hardware_id = "none";
  std::string wrong;
  const auto tell = [&](bool that, const char* what) {
    if (that) wrong += (wrong.empty() ? "" : "; ") + std::string(what);
  };
  tell(degraded_, "more fluid than particles: the oldest join the pools at once");
  tell(frame.fluid.lost > 0.01 * frame.fluid.emitted, "more than 1 % of the fluid left the domain");
  tell(frame.impacts_dropped > dropped_seen_,
       "more impacts than tissue takes in a step: the rest is left out");
  tell(frame.refused > refused_seen_, "steps with absurd input were left out");
  dropped_seen_ = frame.impacts_dropped, refused_seen_ = frame.refused;
  status.level =
      wrong.empty() ? diagnostic_msgs::DiagnosticStatus::OK : diagnostic_msgs::DiagnosticStatus::WARN;
  status.message = wrong.empty() ? "running" : wrong;
  const auto add = [&](const char* key, double value) {
    diagnostic_msgs::KeyValue kv;
    kv.key = key;
    kv.value = std::to_string(value);
    status.values.push_back(kv);
  };
  add("particles", static_cast<double>(frame.fluid.particles.count));
  add("emitted_ml", 1e6 * frame.fluid.emitted);
  add("pools_ml", 1e6 * fluid::poolVolume(*frame.fluid_model, frame.fluid));
  add("sucked_ml", 1e6 * frame.fluid.sucked);
  add("soaked_ml", 1e6 * frame.fluid.soaked);
  add("lost_ml", 1e6 * frame.fluid.lost);
  add("impacts_dropped", static_cast<double>(frame.impacts_dropped));
  add("refused_steps", static_cast<double>(frame.refused));
  add("smoke_mg", 1e6 * frame.smoke_mass);
  add("lens_fog", frame.fog);
  diagnostics_.publish(msg);
}

}  // namespace vest::ros_shell

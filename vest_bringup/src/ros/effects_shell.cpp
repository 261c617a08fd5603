#include "vest_bringup/ros/effects_shell.h"

#include <algorithm>
#include <chrono>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/console.h>
#include <ros/package.h>
#include <vest_msgs/EffectsOptions.h>

#include "vest_instruments/ros/frames.h"
#include "vest_tissue/ros/parameters.h"

namespace vest::ros_shell {

namespace {

/// A word is a database of vest_effects/data/vessels; anything with a slash is a folder.
std::string vesselsFolder(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const std::string package = ros::package::getPath("vest_effects");
  if (package.empty())
    throw std::invalid_argument("vessels '" + name + "': package vest_effects is not on ROS_PACKAGE_PATH");
  return package + "/data/vessels/" + name;
}

std::int64_t steadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

void toMsg(const simulation::GasFrame& f, vest_msgs::GasState& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = f.step;
  msg.set_pressure = static_cast<float>(f.set_pressure);
  msg.pressure = static_cast<float>(f.now.pressure);
  msg.flow = static_cast<float>(f.now.flow);
  msg.leak = static_cast<float>(f.now.leak);
  msg.suction = static_cast<float>(f.suction);
  msg.supplied = f.supplied;
  msg.volume = static_cast<float>(f.now.volume);
  msg.sunk = static_cast<float>(f.now.sunk);
  msg.humidity = static_cast<float>(f.now.humidity);
  msg.temperature = static_cast<float>(f.now.temperature);
}

void toMsg(const simulation::BloodFrame& f, vest_msgs::HaemodynamicsState& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = f.step;
  msg.heart_rate = f.heart_rate;
  msg.systolic = f.systolic;
  msg.diastolic = f.diastolic;
  msg.mean_pressure = f.mean;
  msg.blood_volume = f.blood_volume;
  msg.pressure = f.pressure;
  msg.blood_loss = f.blood_loss;
  msg.loss_rate = f.loss_rate;
  msg.given = f.given;
  msg.transfused = f.transfused;
  msg.haematocrit = static_cast<float>(f.haematocrit);
  msg.vasopressor = static_cast<float>(f.vasopressor);
  msg.ecg = static_cast<float>(f.curves.ecg);
  msg.pleth = static_cast<float>(f.curves.pleth);
  msg.spo2 = static_cast<float>(f.curves.spo2);
  msg.arrested = f.arrested;
  msg.vessels.resize(f.vessels.size());
  for (std::size_t i = 0; i < f.vessels.size(); ++i) {
    const auto& from = f.vessels[i];
    vest_msgs::VesselState& to = msg.vessels[i];
    to.name = (*f.names)[i];
    to.pressure_prox = from.pressure_prox;
    to.pressure_mid = from.pressure_mid;
    to.pressure_dist = from.pressure_dist;
    to.flow_mid = from.flow_mid;
    to.radius_mid = from.radius_mid;
    to.dilatation = from.dilatation;
    to.leak = from.leak;
    to.loss = from.loss;
    to.closure = from.closure;
  }
}

void toMsg(const simulation::SurfaceFrame& f, vest_msgs::SurfaceBleeding& msg) {
  msg.header.frame_id = frameId("world");
  msg.step = f.step;
  msg.revision = f.revision;
  msg.seeped = f.seeped;
  msg.film = f.film;
  msg.wiped = f.wiped;
  msg.fields.resize(5);
  float most = 1e-12f;  // m³/s: a range that is no point
  for (const float q : f.flow) most = std::max(most, q);
  const auto scale = [](const std::vector<float>& values, float maximum, vest_msgs::TissueField& field) {
    field.minimum = 0.0f;
    field.maximum = maximum;
    field.data.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      field.data[i] =
          static_cast<std::uint8_t>(255.0f * std::min(std::max(values[i] / maximum, 0.0f), 1.0f) + 0.5f);
  };
  msg.fields[0].kind = vest_msgs::TissueField::BLEEDING;
  scale(f.flow, most, msg.fields[0]);
  msg.fields[1].kind = vest_msgs::TissueField::WETNESS;
  scale(f.wetness, 1.0f, msg.fields[1]);
  msg.fields[2].kind = vest_msgs::TissueField::PERFUSION;
  scale(f.supply, 1.0f, msg.fields[2]);
  msg.fields[3].kind = vest_msgs::TissueField::OXYGENATION;
  scale(f.oxygen, 1.0f, msg.fields[3]);
  msg.fields[4].kind = vest_msgs::TissueField::SETTING;
  scale(f.set, 1.0f, msg.fields[4]);
}

EffectsShell::EffectsShell(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : exercise_(nh, private_nh), action_(nh, exercise_) {
  const ros::NodeHandle effects(private_nh, "effects");
  options_.insufflation = boolParameter(effects, "insufflation", true);
  const ros::NodeHandle gas(effects, "gas");
  gas::eachNumber(options_.pneumoperitoneum, [&](const char* name, double& to, double low, double high) {
    to = doubleParameter(gas, name, to, low, high);
  });
  gas_pub_ = nh.advertise<vest_msgs::GasState>("effects/gas", 10);
  options_.haemodynamics = boolParameter(effects, "haemodynamics", true);
  simulation::BloodOptions& blood = options_.blood;
  const std::string vessels = stringParameter(effects, "vessels", "pelvis");
  blood.vessels = vesselsFolder(vessels);
  blood.dx = doubleParameter(effects, "vessel_cell", blood.dx, 0.0005, 0.05);
  blood.pulse_dilatation = doubleParameter(effects, "pulse_dilatation", blood.pulse_dilatation, 0.0, 20.0);
  blood.frame_rate = doubleParameter(effects, "haemodynamics_rate", blood.frame_rate, 50.0, 1000.0);
  options_.surface_bleeding = boolParameter(effects, "surface_bleeding", true);
  options_.surface.scale =
      doubleParameter(effects, "surface_bleeding_scale", options_.surface.scale, 0.0, 1000.0);
  options_.surface.frame_rate =
      doubleParameter(effects, "surface_rate", options_.surface.frame_rate, 1.0, 100.0);
  surface_pub_ = nh.advertise<vest_msgs::SurfaceBleeding>("effects/surface", 10);
  options_.field = boolParameter(effects, "field", true);
  if (options_.field) {
    options_.field_options = fieldOptions(effects);
    field_ = std::make_unique<FieldPublisher>(nh);
  }
  diagnostics_pub_ = nh.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  haemodynamics_pub_ = nh.advertise<vest_msgs::HaemodynamicsState>("effects/haemodynamics", 100);
  options_pub_ = nh.advertise<vest_msgs::EffectsOptions>("effects/options", 1, true);
  publishOptions(vessels);
}

void EffectsShell::publishOptions(const std::string& vessels) {
  vest_msgs::EffectsOptions msg;
  msg.header.stamp = ros::Time::now();
  msg.vessels = vessels;
  eachNumber(options_, [&](const char* name, double& value, double, double) {
    msg.names.emplace_back(name);
    msg.values.push_back(value);
  });
  options_pub_.publish(msg);
}

std::unique_ptr<scene::Simulation> EffectsShell::compose(scene::World world) {
  const auto field = field_ ? std::make_shared<simulation::FieldFrames>() : nullptr;
  auto stage = simulation::makeStage(std::move(world), options_,
                                     {&gas_frames_, &blood_frames_, &surface_frames_, field});
  if (field_) field_->show(field);
  exercise_.attach(stage);
  return std::move(stage.trainer);
}

void EffectsShell::publish(const TissueServer::Stamp& stamp) {
  exercise_.publish(stamp(steadyNow()));
  if (gas_frames_.update()) {
    vest_msgs::GasState msg;
    toMsg(gas_frames_.front(), msg);
    msg.header.stamp = stamp(steadyNow());
    gas_pub_.publish(msg);
  }
  if (surface_frames_.update()) {
    const auto msg = surface_pool_.take();
    toMsg(surface_frames_.front(), *msg);
    msg->header.stamp = stamp(steadyNow());
    surface_pub_.publish(vest_msgs::SurfaceBleeding::ConstPtr(msg));
  }
  if (blood_frames_.update()) {
    const simulation::BloodFrame& frame = blood_frames_.front();
    const auto msg = haemodynamics_pool_.take();
    toMsg(frame, *msg);
    msg->header.stamp = stamp(steadyNow());
    haemodynamics_pub_.publish(vest_msgs::HaemodynamicsState::ConstPtr(msg));
    if (frame.degraded_steps > degraded_seen_)
      ROS_WARN_THROTTLE(
          5, "haemodynamics: %u steps with smaller holes, because blood would run as fast as waves",
          frame.degraded_steps);
    if (frame.refused > refused_seen_)
      ROS_WARN("bleeding: %u openings or clips found no room and were left out", frame.refused);
    degraded_seen_ = frame.degraded_steps;
    refused_seen_ = frame.refused;
    const double now = 1e-9 * static_cast<double>(steadyNow());
    if (now < diagnostics_due_) return;
    diagnostics_due_ = now + 1.0;
    diagnose(frame);
  }
}

void EffectsShell::diagnose(const simulation::BloodFrame& frame) {
  diagnostic_msgs::DiagnosticArray msg;
  msg.header.stamp = ros::Time::now();
  msg.status.resize(1);
  diagnostic_msgs::DiagnosticStatus& status = msg.status[0];
  status.name = "vest: circulation";
  status.hardware_id = "none";
  const bool degraded = frame.degraded_steps > degraded_told_, full = frame.refused > 0;
  degraded_told_ = frame.degraded_steps;
  status.level = frame.arrested     ? diagnostic_msgs::DiagnosticStatus::ERROR
                 : degraded || full ? diagnostic_msgs::DiagnosticStatus::WARN
                                    : diagnostic_msgs::DiagnosticStatus::OK;
  status.message = frame.arrested ? "cardiac arrest: the mean pressure was below 25 mmHg for a minute"
                   : degraded     ? "smaller holes than the wounds have: blood would run as fast as waves"
                   : full         ? "more openings or clips than there is room for: the newest are left out"
                                  : "running";
  const auto add = [&](const char* key, double value) {
    diagnostic_msgs::KeyValue kv;
    kv.key = key;
    kv.value = std::to_string(value);
    status.values.push_back(kv);
  };
  add("heart_rate_per_min", 60 * frame.heart_rate);
  add("mean_pressure_mmHg", frame.mean / 133.322);
  add("blood_loss_ml", 1e6 * frame.blood_loss);
  add("degraded_steps", frame.degraded_steps);
  add("openings_or_clips_left_out", frame.refused);
  diagnostics_pub_.publish(msg);
}

}  // namespace vest::ros_shell

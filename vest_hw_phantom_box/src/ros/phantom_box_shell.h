// ROS around BoxReader: parameters in, messages out. Node and nodelet run this same class.
#pragma once

#include <ros/ros.h>

#include <array>
#include <atomic>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "vest_hw_phantom_box/driver/box_reader.h"
#include "vest_hw_phantom_box/driver/time_map.h"

namespace vest::ros_shell {

/// A parameter cannot be used: names it, its value, and what is allowed.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Parameters {
  driver::ReaderOptions reader;
  calibration::Calibration calibration;
  std::array<std::string, protocol::kFootswitches> pedals;
};
/// The names of the pedals are the session's, the rest is the node's own. Throws std::runtime_error or
/// calibration::Error, with one message.
Parameters readParameters(const ros::NodeHandle& session_nh, const ros::NodeHandle& private_nh);

class PhantomBoxShell : public driver::ReaderListener {
 public:
  /// Starts reading at once; throws as readParameters() does.
  PhantomBoxShell(ros::NodeHandle nh, ros::NodeHandle private_nh);
  ~PhantomBoxShell() override;
  /// Says nothing from now on: the session ends, and its box with it. From a signal handler, too.
  void fallSilent() { silent_ = true; }

 private:
  void onSample(const driver::Driver& driver, driver::Nanoseconds arrived) override;
  void onFootswitches(std::uint8_t pressed) override;
  void onPedal(const driver::PedalEvent& event) override;
  void onMessage(Severity severity, const std::string& text) override;
  ros::Time stampOf(const driver::Driver& driver, driver::Nanoseconds arrived);
  void publishDiagnostics(const ros::SteadyTimerEvent&);

  Parameters parameters_;
  std::atomic<bool> silent_{false};
  ros::Publisher joint_states_, footswitches_, diagnostics_;
  std::array<ros::Publisher, protocol::kFootswitches> pedals_;
  ros::SteadyTimer timer_;
  driver::TimeMap time_map_;
  std::uint64_t epoch_ = 0;
  driver::ReaderStatus last_status_;
  ros::SteadyTime last_diagnostics_;
  std::unique_ptr<driver::BoxReader> reader_;
  std::thread thread_;
};

}  // namespace vest::ros_shell

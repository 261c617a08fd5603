// ROS around event devices: pedals and gamepads as Joy, gamepads also as hands of instruments.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <geometry_msgs/PoseStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <vest_msgs/InstrumentStates.h>

#include "vest_hw_phantom_box/events/input_device.h"
#include "vest_instruments/control/teleoperator.h"

namespace vest::ros_shell {

class InputShell {
 public:
  /// @throws std::runtime_error: one message that names file and field, or parameter
  InputShell(ros::NodeHandle nh, ros::NodeHandle private_nh);

 private:
  struct Device {
    const control::EventDevice* wanted;
    std::unique_ptr<events::InputDevice> device;  ///< null while it is not there
    std::string problem;                          ///< why, in words
    double next_try = 0.0, last_sent = -1.0;
    ros::Publisher joy;
  };
  struct Hand {
    control::Teleoperator hand;
    const control::PadControl* pad;
    std::size_t device;
    std::string instrument;
    ros::Publisher pose, jaw;
  };

  static double steadyNow();
  void onTimer();
  void onDiagnostics();
  void onInstruments(const vest_msgs::InstrumentStates& msg);
  void open(Device& d, double now);
  void send(Device& d, double now);
  void move(Hand& hand, double dt);

  control::InputMap map_;
  std::vector<Device> devices_;
  std::vector<Hand> hands_;
  double last_ = -1.0;
  ros::Publisher diagnostics_;
  ros::Subscriber instruments_;
  ros::SteadyTimer timer_, second_;
};

}  // namespace vest::ros_shell

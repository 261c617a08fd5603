#include "camera_hand_tool.h"

#include <geometry_msgs/TwistStamped.h>
#include <rviz/properties/string_property.h>
#include <rviz/viewport_mouse_event.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_instruments/ros/frames.h"

namespace vest::displays {
namespace {
constexpr double kTurn = 0.002, kGo = 0.0002;  // rad/s and m/s per pixel: the hand itself bounds its speed
}

CameraHandTool::CameraHandTool() {
  shortcut_key_ = 'e';
  topic_ = new rviz::StringProperty("Topic", "camera_hand/servo_cv", "geometry_msgs/TwistStamped.",
                                    getPropertyContainer());
}

void CameraHandTool::onInitialize() {
  setName("Camera Hand");
}

void CameraHandTool::activate() {
  command_ = handle_.advertise<geometry_msgs::TwistStamped>(topic_->getStdString(), 10);
  setStatus("Hold the left button and move: turn the endoscope. Right button, up and down: in and out.");
}

void CameraHandTool::deactivate() {
  turns_ = goes_ = false;
  command_.shutdown();
}

void CameraHandTool::update(float, float) {
  if (!command_ || (!turns_ && !goes_)) return;
  geometry_msgs::TwistStamped m;
  m.header.stamp = ros::Time::now();
  m.header.frame_id = ros_shell::frameId("endoscope_optical_frame");
  if (turns_) {
    m.twist.angular.y = kTurn * dx_;
    m.twist.angular.x = -kTurn * dy_;
  } else {
    m.twist.linear.z = -kGo * dy_;
  }
  command_.publish(m);
}

int CameraHandTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  if (event.leftDown() || event.rightDown()) {
    from_x_ = event.x, from_y_ = event.y;
    if (command_.getNumSubscribers() == 0)
      setStatus("Nobody holds the endoscope: start with endoscope:=teleop.");
  }
  turns_ = event.left();
  goes_ = !turns_ && event.right();
  dx_ = event.x - from_x_, dy_ = event.y - from_y_;
  return 0;
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::CameraHandTool, rviz::Tool)

#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <rviz/tool.h>

namespace rviz {
class StringProperty;
}

namespace vest::displays {

/// vest_viz/CameraHand: a third person holds the endoscope. While a button is down, the way of the mouse from
/// where it was pressed says how fast the view goes: left button turns, right button goes in (up) and out.
class CameraHandTool : public rviz::Tool {
 public:
  CameraHandTool();
  void onInitialize() override;
  void activate() override;
  void deactivate() override;
  void update(float wall_dt, float ros_dt) override;
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;

 private:
  rviz::StringProperty* topic_;
  ros::NodeHandle handle_;
  ros::Publisher command_;
  int from_x_ = 0, from_y_ = 0, dx_ = 0, dy_ = 0;
  bool turns_ = false, goes_ = false;
};

}  // namespace vest::displays

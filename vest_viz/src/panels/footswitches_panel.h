#pragma once

#include <array>

#include <ros/subscriber.h>
#include <ros/time.h>
#include <sensor_msgs/Joy.h>

#include "base_panel.h"

namespace vest::panels {

/// vest_viz/Footswitches: six lamps. Older than 100 ms counts as released, and shows as silent.
class FootswitchesPanel : public BasePanel {
 public:
  explicit FootswitchesPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void refresh();

  ros::Subscriber sub_;
  sensor_msgs::Joy last_;
  ros::SteadyTime heard_;
  std::array<QLabel*, 6> lamps_{};
  QLabel* age_;
};

}  // namespace vest::panels

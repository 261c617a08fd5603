#pragma once

#include <map>

#include <ros/subscriber.h>
#include <ros/time.h>
#include <vest_msgs/HapticState.h>

#include "base_panel.h"

class QTableWidget;

namespace vest::panels {

/// vest_viz/Haptics: per device the force asked for and the force rendered, age of the contact model, rate,
/// energy balance and what the limiter did.
class HapticsPanel : public BasePanel {
 public:
  explicit HapticsPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void look();
  void onState(const std::string& topic, const vest_msgs::HapticState& msg);

  std::map<std::string, ros::Subscriber> subs_;   ///< per topic
  std::map<std::string, ros::SteadyTime> heard_;  ///< per topic
  QTableWidget* table_;
};

/// Bits of HapticState.limits in words; empty: nothing was limited.
QString limitWords(std::uint32_t limits);

}  // namespace vest::panels

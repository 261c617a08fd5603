#pragma once

#include <ros/subscriber.h>
#include <vest_msgs/TissueEvent.h>

#include "base_panel.h"

class QTableWidget;

namespace vest::panels {

/// vest_viz/Events: what happened to the tissue, newest last: when, which instrument, what, to which object.
class EventsPanel : public BasePanel {
 public:
  static constexpr int kMost = 500;  ///< lines that are kept

  explicit EventsPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void onEvent(const vest_msgs::TissueEvent& msg);

  ros::Subscriber sub_;
  std::uint64_t last_step_ = 0;
  QTableWidget* table_;
};

/// TissueEvent.kind in a word.
QString eventWord(std::uint8_t kind);

}  // namespace vest::panels

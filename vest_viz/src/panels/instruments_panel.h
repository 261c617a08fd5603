#pragma once

#include <array>

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/OperatingState.h>

#include "base_panel.h"

class QComboBox;
class QGridLayout;

namespace vest::panels {

/// vest_viz/Instruments: per instrument its tool and source (exchanged here), CRTK operating state with its
/// commands, what is switched on, and whether it hits another instrument or the box.
class InstrumentsPanel : public BasePanel {
 public:
  explicit InstrumentsPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  static constexpr std::size_t kCount = 4;  ///< left, right, third, endoscope
  struct Row {
    QComboBox *tool = nullptr, *source = nullptr, *command = nullptr;
    QLabel *operating = nullptr, *active = nullptr;
    ros::Subscriber operating_sub;
    ros::Publisher command_pub;
  };
  void addRow(QGridLayout* grid, std::size_t i);
  void onStates(const vest_msgs::InstrumentStates& msg);
  void exchange(std::size_t i, int tool);
  void select(std::size_t i, int source);

  std::array<Row, kCount> rows_;
  ros::Subscriber states_sub_;
  QLabel* problem_;
};

}  // namespace vest::panels

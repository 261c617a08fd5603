#pragma once

#include <array>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <QPoint>
#include <QPointer>
#include <QWidget>

#include <ros/ros.h>
#include <rviz/tool.h>
#include <vest_msgs/InstrumentStates.h>

#include "key_legend.h"
#include "teleop_sender.h"
#include "vest_instruments/control/teleoperator.h"

namespace rviz {
class EnumProperty;
class FloatProperty;
class StringProperty;
}  // namespace rviz

namespace vest::displays {

/// vest_viz/Teleoperate: keyboard and mouse move an instrument through the source `teleop`, and stand in for
/// the footswitches. Its keys stand on the screen. An instrument that another source moves is taken over with
/// T, explicitly, and given back with T or when the tool is left.
class TeleoperateTool : public rviz::Tool {
 public:
  TeleoperateTool();
  ~TeleoperateTool() override;
  void onInitialize() override;
  void activate() override;
  void deactivate() override;
  void update(float wall_dt, float ros_dt) override;
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;

 protected:
  /// Keys reach it here, with their releases, which rviz tells no tool.
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  void choose(tools::Instrument instrument);
  void takeOrGive();
  void giveBack();
  void command(const std::string& words);
  void moveByKeys(double dt);
  void onStates(const vest_msgs::InstrumentStates& states);
  bool down(int key) const { return held_.count(key) != 0; }
  std::string name() const { return std::string(tools::instrumentName(chosen_)); }
  control::Teleoperator& hand() { return hands_[static_cast<std::size_t>(chosen_)]; }
  /// Unit vectors of the picture (right, up) in phantom_box; false while tf does not know them.
  bool axes(Eigen::Vector3d& right, Eigen::Vector3d& up) const;
  void show();

  rviz::EnumProperty* view_;
  rviz::FloatProperty* per_pixel_;
  rviz::StringProperty* box_file_;
  ros::NodeHandle handle_;
  std::vector<control::Teleoperator> hands_;  ///< one for each instrument
  tools::Instrument chosen_ = tools::Instrument::Right;
  std::optional<vest_msgs::InstrumentState> state_;  ///< of the chosen one, as last heard
  std::uint8_t before_ = vest_msgs::InstrumentState::SOURCE_NONE;
  bool taken_ = false;       ///< by T; before_ tells whom it is given back to
  std::set<int> held_;       ///< keys, Qt::Key
  QPointer<QWidget> panel_;  ///< rviz's view, which may end before its tools
  QPoint last_;
  ros::Subscriber states_;
  std::array<ros::Publisher, tools::kInstrumentCount> commands_;
  std::unique_ptr<TeleopSender> sender_;
  std::unique_ptr<KeyLegend> legend_;
  std::string problem_;
};

}  // namespace vest::displays

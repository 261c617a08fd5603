#include "footswitches_panel.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QTimer>

#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {
constexpr double kStale = 0.1;  ///< s, docs/HAZARDS.md: older counts as released
const char* const kNames[] = {"coag", "cut", "irrigation", "suction", "tool", "clutch"};  // preset `trainer`
const char* const kColours[] = {"#2962c9", "#e0b000", "#1f7f95", "#7d57c1", "#5f6a72", "#5f6a72"};
constexpr std::size_t kCut = 1;  ///< yellow, as such pedals are: with dark words
}  // namespace

FootswitchesPanel::FootswitchesPanel(QWidget* parent) : BasePanel(parent) {
  auto* const rows = new QVBoxLayout(this);
  auto* const line = new QHBoxLayout;
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    lamps_[i] = new QLabel(kNames[i]);
    lamps_[i]->setAlignment(Qt::AlignCenter);
    lamps_[i]->setMinimumHeight(34);
    line->addWidget(lamps_[i]);
  }
  age_ = new QLabel("no footswitches heard");
  rows->addLayout(line);
  rows->addWidget(age_);
  rows->addStretch(1);
  auto* const timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { refresh(); });
  timer->start(50);
  refresh();
}

void FootswitchesPanel::connectTopics() {
  sub_ = nh().subscribe<sensor_msgs::Joy>("phantom_box/footswitches", 5,
                                          [this](const sensor_msgs::JoyConstPtr& msg) {
                                            last_ = *msg;
                                            heard_ = ros::SteadyTime::now();
                                          });
}

void FootswitchesPanel::refresh() {
  const bool stale = heard_.isZero() || (ros::SteadyTime::now() - heard_).toSec() > kStale;
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    const bool down = !stale && i < last_.buttons.size() && last_.buttons[i] == 1;
    const QString style = QString("border-radius: 6px; padding: 2px; color: %1; background: %2")
                              .arg(down && i != kCut ? "white" : "#202020", down ? kColours[i] : "#d8d8d8");
    if (lamps_[i]->styleSheet() != style) lamps_[i]->setStyleSheet(style);
  }
  const QString text = heard_.isZero() ? "no footswitches heard"
                       : stale         ? "silent: all count as released"
                                       : "";
  if (age_->text() != text) age_->setText(text);
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::FootswitchesPanel, rviz::Panel)

#include "footswitches_panel.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QTimer>

#include <pluginlib/class_list_macros.hpp>

#include "vest_instruments/ros/footswitches.h"

namespace vest::panels {
namespace {
using control::PedalFunction;
constexpr double kStale = 0.1;  ///< s: older counts as released

/// Blue coagulates and yellow cuts, as pedals in theatres are.
const char* colourOf(PedalFunction function) {
  switch (function) {
    case PedalFunction::Coagulate:
    case PedalFunction::CoagulateMonopolar:
    case PedalFunction::CoagulateBipolar:
      return "#2962c9";
    case PedalFunction::Cut:
      return "#e0b000";
    case PedalFunction::Irrigate:
      return "#1f7f95";
    case PedalFunction::Suck:
      return "#7d57c1";
    default:
      return "#5f6a72";
  }
}
}  // namespace

FootswitchesPanel::FootswitchesPanel(QWidget* parent) : BasePanel(parent) {
  auto* const rows = new QVBoxLayout(this);
  auto* const line = new QHBoxLayout;
  for (std::size_t i = 0; i < lamps_.size(); ++i) {
    lamps_[i] = new QLabel(QString::fromStdString(pedals_.names[i]));
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
  try {
    pedals_ = vest_instruments::readFootswitches(nh());
  } catch (const std::exception& e) {
    ROS_WARN("footswitches: %s; the lamps keep their names", e.what());
  }
  for (std::size_t i = 0; i < lamps_.size(); ++i)
    lamps_[i]->setText(QString::fromStdString(pedals_.names[i]));
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
                              .arg(down && pedals_.functions[i] != PedalFunction::Cut ? "white" : "#202020",
                                   down ? colourOf(pedals_.functions[i]) : "#d8d8d8");
    if (lamps_[i]->styleSheet() != style) lamps_[i]->setStyleSheet(style);
  }
  const QString text = heard_.isZero() ? "no footswitches heard"
                       : stale         ? "silent: all count as released"
                                       : "";
  if (age_->text() != text) age_->setText(text);
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::FootswitchesPanel, rviz::Panel)

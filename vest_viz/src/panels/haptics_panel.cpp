#include "haptics_panel.h"

#include <cmath>

#include <QHeaderView>
#include <QLabel>
#include <QTableWidget>
#include <QTimer>
#include <QVBoxLayout>

#include <ros/master.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {

constexpr double kHapticsSilent = 0.5;  ///< s
enum Column { kDevice, kInstrument, kAsked, kRendered, kAge, kRate, kEnergy, kLimits, kColumns };

double length(const geometry_msgs::Vector3& v) {
  return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

}  // namespace

QString limitWords(std::uint32_t limits) {
  QStringList words;
  const char* const kWords[] = {"not finite", "magnitude", "slew", "ramp", "stale", "FAULT"};
  for (int bit = 0; bit < 6; ++bit)
    if (limits & (1u << bit)) words << kWords[bit];
  return words.join(", ");
}

HapticsPanel::HapticsPanel(QWidget* parent) : BasePanel(parent) {
  auto* const rows = new QVBoxLayout(this);
  table_ = new QTableWidget(0, kColumns);
  table_->setHorizontalHeaderLabels(
      {"device", "instrument", "asked, N", "rendered, N", "age, ms", "rate, Hz", "energy, mJ", "limits"});
  const char* const tips[] = {
      "",
      "the instrument that the device moves",
      "force that the tissue asks for",
      "force that the device was given, after the safety limiter",
      "of the contact model that the force was computed from",
      "of the force loop",
      "taken from the hand and not yet given back; below 0 the device would drive the hand",
      "what the safety limiter changed last; FAULT: no force until the person resets it"};
  for (int i = 0; i < kColumns; ++i) table_->horizontalHeaderItem(i)->setToolTip(tips[i]);
  table_->verticalHeader()->hide();
  table_->horizontalHeader()->setSectionResizeMode(QHeaderView::ResizeToContents);
  table_->horizontalHeader()->setStretchLastSection(true);
  table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  rows->addWidget(table_);
  auto* const timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { look(); });
  timer->start(1000);
}

void HapticsPanel::connectTopics() {
  subs_.clear();
}

void HapticsPanel::look() {
  // Devices come and go: their topics tell.
  ros::master::V_TopicInfo topics;
  if (!ros::master::getTopics(topics)) return;
  const std::string prefix = nh().resolveName("haptics") + "/";
  for (const auto& topic : topics) {
    if (topic.datatype != "vest_msgs/HapticState" || topic.name.compare(0, prefix.size(), prefix) != 0)
      continue;
    if (subs_.count(topic.name) != 0) continue;
    subs_[topic.name] = nh().subscribe<vest_msgs::HapticState>(
        topic.name, 1,
        [this, name = topic.name](const vest_msgs::HapticStateConstPtr& msg) { onState(name, *msg); });
  }
  for (int row = 0; row < table_->rowCount(); ++row) {
    const auto heard = heard_.find(table_->item(row, kDevice)->data(Qt::UserRole).toString().toStdString());
    if (heard != heard_.end() && (ros::SteadyTime::now() - heard->second).toSec() > kHapticsSilent)
      table_->item(row, kLimits)->setText("silent");
  }
}

void HapticsPanel::onState(const std::string& topic, const vest_msgs::HapticState& msg) {
  heard_[topic] = ros::SteadyTime::now();
  const QString name = QString::fromStdString(topic);  // two hands may have devices of one model
  int row = 0;
  while (row < table_->rowCount() && table_->item(row, kDevice)->data(Qt::UserRole).toString() != name) ++row;
  if (row == table_->rowCount()) {
    table_->insertRow(row);
    for (int column = 0; column < kColumns; ++column) table_->setItem(row, column, new QTableWidgetItem);
    table_->item(row, kDevice)->setData(Qt::UserRole, name);
  }
  table_->item(row, kDevice)->setText(QString::fromStdString(msg.device));
  table_->item(row, kInstrument)->setText(QString::fromStdString(msg.instrument));
  table_->item(row, kAsked)->setText(QString::number(length(msg.force_true), 'f', 2));
  table_->item(row, kRendered)->setText(QString::number(length(msg.force_rendered), 'f', 2));
  table_->item(row, kAge)->setText(QString::number(1e3 * msg.model_age, 'f', 1));
  table_->item(row, kRate)->setText(QString::number(msg.tick_rate, 'f', 0));
  table_->item(row, kEnergy)->setText(QString::number(1e3 * msg.energy, 'f', 2));
  table_->item(row, kLimits)->setText(limitWords(msg.limits));
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::HapticsPanel, rviz::Panel)

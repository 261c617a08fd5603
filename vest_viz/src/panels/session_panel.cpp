#include "session_panel.h"

#include <dirent.h>

#include <QComboBox>
#include <QGridLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QTimer>

#include <ros/package.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <vest_msgs/LoadScene.h>
#include <vest_msgs/Snapshot.h>
#include <vest_msgs/Step.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {

constexpr double kSilent = 2.5;  ///< s: session/state comes at 2 Hz

/// Scenes that are shipped: folders of vest_tissue/scenes.
QStringList shippedScenes() {
  QStringList names;
  const std::string folder = ros::package::getPath("vest_tissue") + "/scenes";
  if (DIR* const dir = opendir(folder.c_str())) {
    while (const dirent* const entry = readdir(dir))
      if (entry->d_name[0] != '.') names << entry->d_name;
    closedir(dir);
  }
  names.sort();
  return names;
}

}  // namespace

SessionPanel::SessionPanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  state_label_ = new QLabel("no simulation heard");
  recording_label_ = new QLabel;
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  pause_ = new QPushButton("Pause");
  step_ = new QPushButton("Step");
  steps_ = new QSpinBox;
  steps_->setRange(1, 100000);
  steps_->setSuffix(" ms");
  steps_->setToolTip("steps of 1 ms of simulated time, while paused");
  reset_ = new QPushButton("Reset");
  scene_ = new QComboBox;
  scene_->setEditable(true);
  scene_->addItems(shippedScenes());
  load_ = new QPushButton("Load");
  snapshot_ = new QLineEdit("snapshot");
  save_ = new QPushButton("Snapshot");
  restore_ = new QPushButton("Restore");
  grid->addWidget(state_label_, 0, 0, 1, 3);
  grid->addWidget(recording_label_, 1, 0, 1, 3);
  grid->addWidget(pause_, 2, 0);
  grid->addWidget(step_, 2, 1);
  grid->addWidget(steps_, 2, 2);
  grid->addWidget(scene_, 3, 0);
  grid->addWidget(load_, 3, 1);
  grid->addWidget(reset_, 3, 2);
  grid->addWidget(snapshot_, 4, 0);
  grid->addWidget(save_, 4, 1);
  grid->addWidget(restore_, 4, 2);
  grid->addWidget(problem_, 5, 0, 1, 3);
  grid->setRowStretch(6, 1);

  connect(pause_, &QPushButton::clicked, this, [this] {
    std_srvs::SetBool pause;
    pause.request.data = state_.state != vest_msgs::SessionState::PAUSED;
    call<std_srvs::SetBool>("tissue/pause", pause, [this](const auto& answer, const std::string& problem) {
      tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
    });
  });
  connect(step_, &QPushButton::clicked, this, [this] {
    vest_msgs::Step step;
    step.request.steps = static_cast<std::uint32_t>(steps_->value());
    call<vest_msgs::Step>("tissue/step", step, [this](const auto& answer, const std::string& problem) {
      tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
    });
  });
  connect(reset_, &QPushButton::clicked, this, [this] {
    call<std_srvs::Trigger>("tissue/reset", {}, [this](const auto& answer, const std::string& problem) {
      tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
    });
  });
  connect(load_, &QPushButton::clicked, this, [this] {
    vest_msgs::LoadScene load;
    load.request.scene = scene_->currentText().toStdString();
    call<vest_msgs::LoadScene>(
        "tissue/load_scene", load, [this](const auto& answer, const std::string& problem) {
          tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
        });
  });
  connect(save_, &QPushButton::clicked, this, [this] { snapshot(false); });
  connect(restore_, &QPushButton::clicked, this, [this] { snapshot(true); });
  auto* const timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { showAge(); });
  timer->start(500);
}

void SessionPanel::connectTopics() {
  state_sub_ = nh().subscribe<vest_msgs::SessionState>(
      "session/state", 5, [this](const vest_msgs::SessionStateConstPtr& msg) { onState(*msg); });
}

void SessionPanel::snapshot(bool restore) {
  vest_msgs::Snapshot snapshot;
  snapshot.request.operation =
      restore ? vest_msgs::SnapshotRequest::RESTORE : vest_msgs::SnapshotRequest::SAVE;
  snapshot.request.name = snapshot_->text().toStdString();
  call<vest_msgs::Snapshot>(
      "tissue/snapshot", snapshot, [this](const auto& answer, const std::string& problem) {
        tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
      });
}

void SessionPanel::onState(const vest_msgs::SessionState& msg) {
  static const char* const kWords[] = {"idle", "running", "paused", "FAULT"};
  const bool scene_changed = msg.scene != state_.scene;
  state_ = msg;
  heard_ = ros::WallTime::now();
  state_label_->setText(QString("<b>%1</b>, %2: step %3, %4 s, real time ×%5, %6 µs per step")
                            .arg(msg.state < 4 ? kWords[msg.state] : "?", QString::fromStdString(msg.scene))
                            .arg(msg.step)
                            .arg(msg.simulated_time, 0, 'f', 1)
                            .arg(msg.real_time_factor, 0, 'f', 3)
                            .arg(1e6 * msg.step_cpu_time, 0, 'f', 0));
  recording_label_->setText(msg.recording
                                ? QString("recording to %1: %2 MB, %3 messages, %4 lost")
                                      .arg(QString::fromStdString(msg.directory))
                                      .arg(1e-6 * static_cast<double>(msg.recorded_bytes), 0, 'f', 1)
                                      .arg(msg.recorded_messages)
                                      .arg(msg.dropped_messages)
                                : "not recording");
  const bool paused = msg.state == vest_msgs::SessionState::PAUSED;
  pause_->setText(paused ? "Resume" : "Pause");
  step_->setEnabled(paused);
  if (scene_changed) scene_->setCurrentText(QString::fromStdString(msg.scene));
}

void SessionPanel::showAge() {
  if (heard_.isZero() || (ros::WallTime::now() - heard_).toSec() < kSilent) return;
  state_label_->setText("<b>silent</b>: no word from the simulation for " +
                        QString::number((ros::WallTime::now() - heard_).toSec(), 'f', 0) + " s");
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::SessionPanel, rviz::Panel)

#include "session_panel.h"

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSpinBox>
#include <QTimer>

#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <vest_msgs/LoadScene.h>
#include <vest_msgs/SetSpeed.h>
#include <vest_msgs/Snapshot.h>
#include <vest_msgs/Step.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {

constexpr double kSessionSilent = 2.5;  ///< s: session/state comes at 2 Hz

}  // namespace

template <class Service>
void SessionPanel::ask(const std::string& name, const Service& service) {
  call<Service>(name, service, [this](const auto& answer, const std::string& problem) {
    tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
  });
}

SessionPanel::SessionPanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  state_label_ = new QLabel("no simulation heard");
  recording_label_ = new QLabel;
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  start_ = new QPushButton("Record");
  start_->setToolTip("begins a new recording; an earlier one in the folder is set aside");
  stop_ = new QPushButton("Stop");
  stop_->setToolTip("closes the recording; the simulation goes on");
  pause_ = new QPushButton("Pause");
  pause_->setToolTip("halts the simulation between two steps, and lets it go on");
  step_ = new QPushButton("Step");
  step_->setToolTip("advances the paused simulation by the time on the right");
  steps_ = new QSpinBox;
  steps_->setRange(1, 100000);
  steps_->setSuffix(" ms");
  steps_->setToolTip("simulated time of a click on Step; a step takes 1 ms");
  speed_ = new QDoubleSpinBox;
  speed_->setRange(0.01, 1000);
  speed_->setValue(1);
  speed_->setPrefix("× ");
  speed_->setKeyboardTracking(false);
  speed_->setToolTip("speed that is aimed at, simulated over real time; the first line says what is reached");
  reset_ = new QPushButton("Reset");
  reset_->setToolTip("back to the beginning of the scene");
  scene_ = new QComboBox;
  scene_->setToolTip("a scene of vest_tissue, or the path of a scene file");
  scene_->setEditable(true);
  scene_->addItems(shipped("vest_tissue", "scenes"));
  load_ = new QPushButton("Load scene");
  load_->setToolTip("replaces the scene; if it is refused the present one goes on");
  snapshot_ = new QLineEdit("snapshot");
  snapshot_->setToolTip("name of the snapshot: a word; to restore, also the absolute path of a file");
  save_ = new QPushButton("Save snapshot");
  save_->setToolTip("keeps the whole state of the simulation under this name");
  restore_ = new QPushButton("Restore");
  restore_->setToolTip("puts the simulation back into the state of this name");
  // Few rows: it has its place below the picture of a small screen.
  grid->setContentsMargins(4, 4, 4, 4);
  grid->setVerticalSpacing(3);
  state_label_->setWordWrap(true);
  recording_label_->setWordWrap(true);
  constexpr int kAcross = 6;
  grid->addWidget(state_label_, 0, 0, 1, kAcross);
  grid->addWidget(recording_label_, 1, 0, 1, kAcross);
  grid->addWidget(start_, 2, 0);
  grid->addWidget(stop_, 2, 1);
  grid->addWidget(pause_, 2, 2);
  grid->addWidget(step_, 2, 3);
  grid->addWidget(steps_, 2, 4);
  grid->addWidget(speed_, 2, 5);
  grid->addWidget(scene_, 3, 0, 1, 3);
  grid->addWidget(load_, 3, 3, 1, 2);
  grid->addWidget(reset_, 3, 5);
  grid->addWidget(snapshot_, 4, 0, 1, 3);
  grid->addWidget(save_, 4, 3, 1, 2);
  grid->addWidget(restore_, 4, 5);
  grid->addWidget(problem_, 5, 0, 1, kAcross);
  grid->setRowStretch(6, 1);

  connect(start_, &QPushButton::clicked, this, [this] { ask<std_srvs::Trigger>("session/start", {}); });
  connect(stop_, &QPushButton::clicked, this, [this] { ask<std_srvs::Trigger>("session/stop", {}); });
  connect(pause_, &QPushButton::clicked, this, [this] {
    std_srvs::SetBool pause;
    pause.request.data = state_.state != vest_msgs::SessionState::PAUSED;
    ask("tissue/pause", pause);
  });
  connect(step_, &QPushButton::clicked, this, [this] {
    vest_msgs::Step step;
    step.request.steps = static_cast<std::uint32_t>(steps_->value());
    ask("tissue/step", step);
  });
  connect(speed_, &QDoubleSpinBox::editingFinished, this, [this] {
    vest_msgs::SetSpeed speed;
    speed.request.speed = speed_->value();
    ask("tissue/speed", speed);
  });
  connect(reset_, &QPushButton::clicked, this, [this] { ask<std_srvs::Trigger>("tissue/reset", {}); });
  connect(load_, &QPushButton::clicked, this, [this] {
    vest_msgs::LoadScene load;
    load.request.scene = scene_->currentText().toStdString();
    ask("tissue/load_scene", load);
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
  recorder_ = {};
  recorder_sub_ = nh().subscribe<vest_msgs::SessionState>(
      "session/recording", 5, [this](const vest_msgs::SessionStateConstPtr& msg) {
        recorder_.heard(msg->recording, ros::SteadyTime::now().toSec());
      });
}

void SessionPanel::snapshot(bool restore) {
  vest_msgs::Snapshot snapshot;
  snapshot.request.operation =
      restore ? vest_msgs::SnapshotRequest::RESTORE : vest_msgs::SnapshotRequest::SAVE;
  snapshot.request.name = snapshot_->text().toStdString();
  ask("tissue/snapshot", snapshot);
}

void SessionPanel::onState(const vest_msgs::SessionState& msg) {
  static const char* const kWords[] = {"idle", "running", "paused", "FAULT"};
  const bool scene_changed = msg.scene != state_.scene;
  state_ = msg;
  heard_ = ros::SteadyTime::now();
  state_label_->setText(QString("<b>%1</b>, %2: step %3, %4 s, real time ×%5, %6 µs per step")
                            .arg(msg.state < 4 ? kWords[msg.state] : "?", QString::fromStdString(msg.scene))
                            .arg(msg.step)
                            .arg(msg.simulated_time, 0, 'f', 1)
                            .arg(msg.real_time_factor, 0, 'f', 3)
                            .arg(1e6 * msg.step_cpu_time, 0, 'f', 0));
  if (!recorder_.lost(heard_.toSec()))
    recording_label_->setText(
        msg.recording ? QString("recording to %1: %2 MB, %3 messages, %4 lost")
                            .arg(QString::fromStdString(msg.directory))
                            .arg(1e-6 * static_cast<double>(msg.recorded_bytes), 0, 'f', 1)
                            .arg(msg.recorded_messages)
                            .arg(msg.dropped_messages)
                      : QString::fromStdString(msg.status.empty() ? "not recording" : msg.status));
  const bool paused = msg.state == vest_msgs::SessionState::PAUSED;
  pause_->setText(paused ? "Resume" : "Pause");
  step_->setEnabled(paused);
  start_->setEnabled(!msg.recording);
  stop_->setEnabled(msg.recording);
  if (scene_changed) scene_->setCurrentText(QString::fromStdString(msg.scene));
}

void SessionPanel::showAge() {
  if (recorder_.lost(ros::SteadyTime::now().toSec()))
    recording_label_->setText(
        "<b style='color: #b00020'>NOT RECORDED: the recorder ended without a word</b>");
  if (heard_.isZero() || (ros::SteadyTime::now() - heard_).toSec() < kSessionSilent) return;
  state_label_->setText("<b>silent</b>: no word from the simulation for " +
                        QString::number((ros::SteadyTime::now() - heard_).toSec(), 'f', 0) + " s");
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::SessionPanel, rviz::Panel)

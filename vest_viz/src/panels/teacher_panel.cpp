#include "teacher_panel.h"

#include <algorithm>

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>

#include <rviz/display_group.h>
#include <rviz/visualization_manager.h>
#include <std_srvs/SetBool.h>
#include <vest_msgs/ParameterEdit.h>
#include <vest_msgs/SelectSource.h>
#include <vest_msgs/StringStamped.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {

/// Of a lens from the cold theatre: it steams up.
constexpr double kColdLens = 293.15;  // K

/// What fails: a parameter that goes to 0 (docs/parameters.md), or a hand that nobody moves.
struct Fault {
  const char *words, *object, *parameter;
  double usual;  ///< mended; the default of docs/parameters.md
  int hand;      ///< −1: none
};
const Fault kFaults[] = {{"coagulation hook without power", "", "monopolar_power", 30, -1},
                         {"bipolar forceps without power", "", "bipolar_power", 25, -1},
                         {"suction fails", "fluid", "suction_flow", 5e-5, -1},
                         {"irrigation fails", "fluid", "irrigation_flow", 5e-5, -1},
                         {"insufflator fails", "gas", "max_flow", 3.33e-4, -1},
                         {"left instrument does not move", "", "", 0, 0},
                         {"right instrument does not move", "", "", 0, 1}};
const char* const kHandNames[] = {"left", "right"};

}  // namespace

TeacherPanel::TeacherPanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  grid->setContentsMargins(4, 4, 4, 4);
  grid->setVerticalSpacing(3);
  pause_ = new QPushButton("Pause");
  pause_->setToolTip("halts the simulation, and lets it go on");
  vessel_ = new QComboBox;
  vessel_->setToolTip("vessel that will bleed, in the middle of its length");
  area_ = new QDoubleSpinBox;
  area_->setRange(0.01, 100);
  area_->setValue(1);
  area_->setSuffix(" mm²");
  area_->setToolTip("area of the hole");
  bleed_ = new QPushButton("Make it bleed");
  bleed_->setToolTip("opens the vessel with the next step");
  fog_ = new QPushButton("Fog the lens");
  fog_->setToolTip("the lens is as cold as the theatre: it steams up until it is warm or wiped");
  fault_ = new QComboBox;
  for (const Fault& fault : kFaults) fault_->addItem(fault.words);
  fault_->setToolTip("device that fails");
  fail_ = new QPushButton("Fail");
  mend_ = new QPushButton("Mend");
  mend_->setToolTip("gives it the usual value, or the hand its mover again");
  camera_button_ = new QPushButton("Take the camera");
  camera_button_->setToolTip(
      "the camera hand moves the endoscope (tool Camera Hand of rviz); again: gives it back");
  words_ = new QLineEdit;
  words_->setPlaceholderText("what the trainee shall read");
  words_->setMaxLength(200);
  say_ = new QPushButton("Tell");
  say_->setToolTip("shows it over the picture for 8 s; it stands in the report");
  pen_ = new QComboBox;
  for (const char* const pen : {"off", "line", "arrow", "circle"}) pen_->addItem(pen);
  pen_->setToolTip("what the left button of the mouse draws on the picture; the trainee sees it for 8 s");
  auto* const draw = new QLabel("Draw with the mouse");
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  auto* const about = new QLabel("All of this is recorded, and the result is then called assisted.");
  about->setWordWrap(true);
  grid->addWidget(pause_, 0, 0);
  grid->addWidget(fog_, 0, 1);
  grid->addWidget(camera_button_, 0, 2);
  grid->addWidget(vessel_, 1, 0);
  grid->addWidget(area_, 1, 1);
  grid->addWidget(bleed_, 1, 2);
  grid->addWidget(fault_, 2, 0);
  grid->addWidget(fail_, 2, 1);
  grid->addWidget(mend_, 2, 2);
  grid->addWidget(words_, 3, 0, 1, 2);
  grid->addWidget(say_, 3, 2);
  grid->addWidget(draw, 4, 0, 1, 2);
  grid->addWidget(pen_, 4, 2);
  grid->addWidget(about, 5, 0, 1, 3);
  grid->addWidget(problem_, 6, 0, 1, 3);
  grid->setRowStretch(7, 1);
  connect(pause_, &QPushButton::clicked, this, [this] {
    std_srvs::SetBool pause;
    pause.request.data = !paused_;
    assisted();
    call<std_srvs::SetBool>("tissue/pause", pause,
                            [this](const auto&, const std::string& problem) { tell(problem_, problem); });
  });
  connect(bleed_, &QPushButton::clicked, this, [this] { bleed(); });
  connect(fog_, &QPushButton::clicked, this, [this] { edit("lens", "temperature", kColdLens); });
  connect(fail_, &QPushButton::clicked, this, [this] { fail(true); });
  connect(mend_, &QPushButton::clicked, this, [this] { fail(false); });
  connect(camera_button_, &QPushButton::clicked, this, [this] { takeCamera(); });
  connect(say_, &QPushButton::clicked, this, [this] { say(); });
  connect(pen_, &QComboBox::currentTextChanged, this, [this](const QString& pen) { takePen(pen); });
  connect(words_, &QLineEdit::returnPressed, this, [this] { say(); });
}

void TeacherPanel::connectTopics() {
  state_sub_ = nh().subscribe<vest_msgs::SessionState>(
      "session/state", 2, [this](const vest_msgs::SessionStateConstPtr& msg) {
        paused_ = msg->state == vest_msgs::SessionState::PAUSED;
        pause_->setText(paused_ ? "Resume" : "Pause");
      });
  topology_sub_ = nh().subscribe<vest_msgs::TissueTopology>(
      "tissue/topology", 1, [this](const vest_msgs::TissueTopologyConstPtr& msg) { onTopology(*msg); });
  instruments_sub_ = nh().subscribe<vest_msgs::InstrumentStates>(
      "tissue/instruments", 1,
      [this](const vest_msgs::InstrumentStatesConstPtr& msg) { onInstruments(*msg); });
  edit_pub_ = nh().advertise<vest_msgs::ParameterEdit>("parameter_edit", 10);
  notes_pub_ = nh().advertise<vest_msgs::StringStamped>("session/notes", 10);
}

void TeacherPanel::onTopology(const vest_msgs::TissueTopology& msg) {
  if (msg.scene_hash == scene_hash_) return;
  scene_hash_ = msg.scene_hash;
  vessels_.clear(), vessel_->clear();
  for (const auto& object : msg.objects) {
    if (object.vessel_segment.empty() || object.centre_line_station.size() < 2) continue;
    vessels_.push_back({object.name, object.centre_line_station.back() - object.centre_line_station.front()});
    vessel_->addItem(QString::fromStdString(object.name));
  }
  bleed_->setEnabled(!vessels_.empty());
}

void TeacherPanel::onInstruments(const vest_msgs::InstrumentStates& msg) {
  for (const auto& instrument : msg.instruments) {
    if (instrument.name == "endoscope") camera_ = instrument.source;
    for (std::size_t hand = 0; hand < hands_.size(); ++hand)
      if (instrument.name == kHandNames[hand]) hands_[hand] = instrument.source;
  }
  camera_button_->setText(camera_ == vest_msgs::InstrumentState::SOURCE_TELEOP ? "Give the camera back"
                                                                               : "Take the camera");
}

void TeacherPanel::edit(const std::string& object, const std::string& parameter, double value) {
  vest_msgs::ParameterEdit edit;
  edit.object = object, edit.parameter = parameter, edit.value = value;
  tell(problem_,
       edit_pub_.getNumSubscribers() == 0 ? "nobody takes parameter_edit: is the trainer running?" : "");
  edit_pub_.publish(edit);
}

void TeacherPanel::bleed() {
  const auto i = static_cast<std::size_t>(std::max(vessel_->currentIndex(), 0));
  if (i >= vessels_.size()) return;
  edit(vessels_[i].name, "opening_station", vessels_[i].length / 2);
  edit(vessels_[i].name, "opening_area", 1e-6 * area_->value());
}

void TeacherPanel::fail(bool fails) {
  const Fault& fault =
      kFaults[std::clamp(fault_->currentIndex(), 0, static_cast<int>(std::size(kFaults)) - 1)];
  if (fault.hand < 0) return edit(fault.object, fault.parameter, fails ? 0 : fault.usual);
  constexpr std::uint8_t kNobody = vest_msgs::InstrumentState::SOURCE_NONE;
  const auto hand = static_cast<std::size_t>(fault.hand);
  if (fails && hands_[hand] != kNobody) hands_before_[hand] = hands_[hand];
  select(kHandNames[hand], fails ? kNobody : hands_before_[hand]);
}

void TeacherPanel::takeCamera() {
  constexpr std::uint8_t kMine = vest_msgs::InstrumentState::SOURCE_TELEOP;
  if (camera_ != kMine) camera_before_ = camera_;
  select("endoscope", camera_ == kMine ? camera_before_ : kMine);
}

void TeacherPanel::select(const std::string& instrument, std::uint8_t source) {
  assisted();
  vest_msgs::SelectSource select;
  select.request.instrument = instrument, select.request.source = source;
  call<vest_msgs::SelectSource>("select_source", select,
                                [this](const auto& answer, const std::string& problem) {
                                  tell(problem_, !problem.empty() ? problem : answer.response.message);
                                });
}

void TeacherPanel::takePen(const QString& pen) {
  if (vis_manager_ == nullptr) return;
  rviz::DisplayGroup* const all = vis_manager_->getRootDisplayGroup();
  for (int i = 0; i < all->numDisplays(); ++i) {
    rviz::Display* const display = all->getDisplayAt(i);
    if (display->getClassId() == "vest_viz/EndoscopicView") display->subProp("Draw")->setValue(pen);
  }
}

void TeacherPanel::say() {
  if (words_->text().trimmed().isEmpty()) return;
  vest_msgs::StringStamped msg;
  msg.header.stamp = ros::Time::now();
  msg.string = words_->text().trimmed().toStdString();
  assisted();
  notes_pub_.publish(msg);
  words_->clear();
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::TeacherPanel, rviz::Panel)

#include "teleoperate_tool.h"

#include <algorithm>

#include <QEvent>
#include <QKeyEvent>

#include <OgreCamera.h>
#include <ros/package.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/render_panel.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <rviz/viewport_mouse_event.h>
#include <vest_msgs/StringStamped.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_instruments/ros/frames.h"

namespace vest::displays {
namespace {

// Held keys move at these speeds: assumed, calm hands in box training.
constexpr double kSpeed = 0.03;         // m/s
constexpr double kTurn = 1.5;           // rad/s, roll and jaw
constexpr double kNotch = 0.002;        // m for a notch of the wheel
constexpr double kRollPerPixel = 0.01;  // rad

constexpr std::array<const char*, TeleopSender::kSwitches> kPedals{"coag",    "cut",  "irrigation",
                                                                   "suction", "tool", "clutch"};
enum View { kEndoscope, kWindow };

Eigen::Vector3d toEigen(const Ogre::Vector3& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

}  // namespace

TeleoperateTool::TeleoperateTool() {
  shortcut_key_ = 't';
  view_ = new rviz::EnumProperty("Move In", "Endoscopic picture",
                                 "What up, down, left and right mean: the endoscope's picture, or this view.",
                                 getPropertyContainer());
  view_->addOption("Endoscopic picture", kEndoscope);
  view_->addOption("This view", kWindow);
  per_pixel_ = new rviz::FloatProperty("Metres Per Pixel", 0.0002f, "How far a drag moves the tip.",
                                       getPropertyContainer());
  box_file_ = new rviz::StringProperty(
      "Trainer Box", "", "Layout of the box; empty: that of vest_instruments.", getPropertyContainer());
}

TeleoperateTool::~TeleoperateTool() {
  deactivate();
}

void TeleoperateTool::onInitialize() {
  setName("Teleoperate");
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    commands_[i] = handle_.advertise<vest_msgs::StringStamped>(
        std::string(tools::instrumentName(static_cast<tools::Instrument>(i))) + "/state_command", 5);
  }
}

void TeleoperateTool::activate() {
  const std::string file = box_file_->getStdString();
  hands_.clear();
  try {
    const kinematics::TrainerBox box = kinematics::loadTrainerBox(
        file.empty() ? ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml" : file);
    for (const kinematics::TrainerArm& arm : box.arms) hands_.emplace_back(arm);
  } catch (const files::FileError& e) {
    problem_ = e.what();
    setStatus(QString::fromStdString(problem_));
    return;
  }
  problem_.clear();
  panel_ = context_->getViewManager()->getRenderPanel();
  panel_->installEventFilter(this);
  panel_->setFocus(Qt::OtherFocusReason);
  legend_ = std::make_unique<KeyLegend>(panel_);
  sender_ = std::make_unique<TeleopSender>(handle_);
  states_ = handle_.subscribe<vest_msgs::InstrumentStates>(
      "instruments", 1, [this](const vest_msgs::InstrumentStatesConstPtr& msg) { onStates(*msg); });
  choose(chosen_);
}

void TeleoperateTool::deactivate() {
  if (sender_ == nullptr) return;
  giveBack();
  if (panel_) panel_->removeEventFilter(this);
  states_.shutdown();
  sender_.reset();
  legend_.reset();
  held_.clear();
}

void TeleoperateTool::choose(tools::Instrument instrument) {
  giveBack();
  chosen_ = instrument;
  state_.reset();
  sender_->choose(name());
  show();
}

void TeleoperateTool::command(const std::string& words) {
  vest_msgs::StringStamped msg;
  msg.header.stamp = ros::Time::now();
  msg.string = words;
  commands_[static_cast<std::size_t>(chosen_)].publish(msg);
}

void TeleoperateTool::takeOrGive() {
  if (taken_) {
    giveBack();
  } else if (state_ && state_->source != vest_msgs::InstrumentState::SOURCE_TELEOP) {
    before_ = state_->source;
    taken_ = true;
    command("source:teleop");
  }
}

void TeleoperateTool::giveBack() {
  if (!taken_) return;
  taken_ = false;
  const auto source = control::sourceFromValue(before_);
  if (source) command("source:" + std::string(control::sourceName(*source)));
}

void TeleoperateTool::onStates(const vest_msgs::InstrumentStates& states) {
  for (const vest_msgs::InstrumentState& s : states.instruments) {
    if (s.name != name()) continue;
    state_ = s;
    // While another source moves it the hand follows, so that a take-over has no jump.
    if (s.source != vest_msgs::InstrumentState::SOURCE_TELEOP)
      hand().place(control::Joints(s.joint_position.data()));
  }
}

bool TeleoperateTool::axes(Eigen::Vector3d& right, Eigen::Vector3d& up) const {
  Ogre::Vector3 position;
  Ogre::Quaternion box, picture;
  if (!context_->getFrameManager()->getTransform(ros_shell::frameId("phantom_box"), ros::Time(), position,
                                                 box))
    return false;
  if (view_->getOptionInt() == kEndoscope) {
    if (!context_->getFrameManager()->getTransform(ros_shell::frameId("endoscope_optical_frame"), ros::Time(),
                                                   position, picture))
      return false;
    right = toEigen(box.Inverse() * picture.xAxis());
    up = -toEigen(box.Inverse() * picture.yAxis());  // REP 103: y of an optical frame points down
    return true;
  }
  const Ogre::Quaternion camera =
      context_->getViewManager()->getCurrent()->getCamera()->getDerivedOrientation();
  right = toEigen(box.Inverse() * camera.xAxis());
  up = toEigen(box.Inverse() * camera.yAxis());
  return true;
}

void TeleoperateTool::moveByKeys(double dt) {
  const auto pair = [&](int minus, int plus) { return (down(plus) ? 1.0 : 0.0) - (down(minus) ? 1.0 : 0.0); };
  Eigen::Vector3d right, up;
  const double x = pair(Qt::Key_A, Qt::Key_D), y = pair(Qt::Key_S, Qt::Key_W);
  if ((x != 0.0 || y != 0.0) && axes(right, up)) hand().shift(kSpeed * dt * (x * right + y * up));
  control::Joints step = control::Joints::Zero();
  step[2] = kSpeed * dt * pair(Qt::Key_Q, Qt::Key_E);
  step[3] = kTurn * dt * pair(Qt::Key_F, Qt::Key_R);
  step[4] = kTurn * dt * pair(Qt::Key_C, Qt::Key_V);
  hand().add(step);
}

void TeleoperateTool::update(float wall_dt, float) {
  if (sender_ == nullptr) return;
  moveByKeys(std::min(static_cast<double>(wall_dt), 0.2));
  std::uint32_t switches = 0;
  for (int i = 0; i < TeleopSender::kSwitches; ++i) {
    if (down(Qt::Key_F1 + i)) switches |= 1u << i;
  }
  sender_->set(state_ && state_->source == vest_msgs::InstrumentState::SOURCE_TELEOP, hand().tip(),
               hand().jaw(), switches);
  show();
}

int TeleoperateTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  if (sender_ == nullptr) return 0;
  const QPoint now(event.x, event.y);
  if (event.leftDown() || event.rightDown() || event.type == QEvent::MouseButtonPress) {
    last_ = now;
    return 0;
  }
  const QPoint moved = now - last_;
  last_ = now;
  control::Joints step = control::Joints::Zero();
  if (event.left()) {
    Eigen::Vector3d right, up;
    if (axes(right, up))
      hand().shift(static_cast<double>(per_pixel_->getFloat()) * (moved.x() * right - moved.y() * up));
  } else if (event.right()) {
    step[3] = kRollPerPixel * moved.x();
  }
  if (event.wheel_delta != 0) step[2] = kNotch * event.wheel_delta / 120.0;
  hand().add(step);
  return Render;
}

bool TeleoperateTool::eventFilter(QObject*, QEvent* event) {
  if (event->type() == QEvent::FocusOut) held_.clear();  // nobody will tell of the release
  if (event->type() != QEvent::KeyPress && event->type() != QEvent::KeyRelease) return false;
  const auto* const key = static_cast<QKeyEvent*>(event);
  constexpr std::array<int, 16> kOurs{Qt::Key_W,  Qt::Key_A,  Qt::Key_S,  Qt::Key_D, Qt::Key_E,  Qt::Key_Q,
                                      Qt::Key_R,  Qt::Key_F,  Qt::Key_C,  Qt::Key_V, Qt::Key_F1, Qt::Key_F2,
                                      Qt::Key_F3, Qt::Key_F4, Qt::Key_F5, Qt::Key_F6};
  const int k = key->key();
  if (std::find(kOurs.begin(), kOurs.end(), k) != kOurs.end()) {
    if (key->isAutoRepeat()) return true;
    if (event->type() == QEvent::KeyPress)
      held_.insert(k);
    else
      held_.erase(k);
    return true;
  }
  if (k != Qt::Key_T && (k < Qt::Key_1 || k > Qt::Key_4)) return false;
  if (event->type() == QEvent::KeyPress && !key->isAutoRepeat()) {
    if (k == Qt::Key_T)
      takeOrGive();
    else
      choose(static_cast<tools::Instrument>(k - Qt::Key_1));
  }
  return true;
}

void TeleoperateTool::show() {
  const auto from = state_ ? control::sourceFromValue(state_->source) : std::nullopt;
  const std::string source = from ? std::string(control::sourceName(*from)) : "nobody: it was not heard of";
  const bool ours = source == "teleop";
  const auto any = [&](std::initializer_list<int> keys) {
    bool lit = false;
    for (const int k : keys) lit = lit || down(k);
    return lit;
  };
  std::vector<KeyLegend::Row> rows{
      {"1 2 3 4", "left, right, third, endoscope"},
      {"T",
       taken_ ? "give it back"
       : ours ? "it is yours"
              : "take it over",
       ours},
      {"W A S D, drag", "up, left, down, right in the picture",
       any({Qt::Key_W, Qt::Key_A, Qt::Key_S, Qt::Key_D})},
      {"E Q, wheel", "in, out", any({Qt::Key_E, Qt::Key_Q})},
      {"R F, right drag", "roll", any({Qt::Key_R, Qt::Key_F})},
  };
  if (chosen_ == tools::Instrument::Endoscope)
    rows.push_back({"C V", "light post", any({Qt::Key_C, Qt::Key_V})});
  else
    rows.push_back({"C V", "close, open the jaws", any({Qt::Key_C, Qt::Key_V})});
  for (int i = 0; i < TeleopSender::kSwitches; ++i)
    rows.push_back({QString("F%1").arg(i + 1), kPedals[static_cast<std::size_t>(i)], down(Qt::Key_F1 + i)});
  legend_->show(QString::fromStdString("Teleoperate " + name() + (ours ? "" : " (moved by " + source + ")")),
                rows);
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::TeleoperateTool, rviz::Tool)

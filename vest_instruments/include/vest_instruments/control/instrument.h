#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Geometry>

#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::control {

/// Who moves an instrument. Values are those of vest_msgs/InstrumentState SOURCE_*.
enum class Source : std::uint8_t { None = 0, Box = 1, Haptic = 2, Crtk = 3, Teleop = 4, Replay = 5 };
std::string_view sourceName(Source source);                   ///< none, box, haptic, crtk, teleop, replay
std::optional<Source> sourceFromName(std::string_view name);  ///< inverse of sourceName
std::optional<Source> sourceFromValue(std::uint8_t value);    ///< empty where out of range

/// CRTK operating states (collaborative-robotics, "Robot API status").
enum class OperatingState { Disabled, Enabled, Paused, Fault };
std::string_view operatingStateName(OperatingState state);  ///< DISABLED, ENABLED, PAUSED, FAULT

/// Why an input was not taken; Taken where it was, Limited where it was as far as the arm reaches.
enum class Verdict { Taken, Limited, OtherSource, NotEnabled, NotHomed, NotFinite, Clutched, OutOfReach };
std::string_view verdictText(Verdict verdict);

/// Joint space values in the order yaw, pitch, insertion, roll, jaw (or light_post).
using Joints = Eigen::Matrix<double, 5, 1>;
Joints toJoints(const kinematics::JointPositions& q);
kinematics::JointPositions fromJoints(const Joints& q);

/// Where an instrument stands until the first input comes: 0.1 m deep, and its shaft points at the aim of its
/// trocar. Of an endoscope the optic does: an angled one has its shaft above that.
Joints startJoints(const kinematics::TrainerArm& arm);

/// One instrument behind its trocar: which input moves it, limits, operating state, moves, silence. Time is
/// steady time in seconds given by the caller; there is no clock, log, allocation or exception after
/// building.
class Instrument {
 public:
  static constexpr double kSilence = 0.1;  ///< s without input after which the pose is no longer valid
  /// Fastest moves of move_jp and move_cp: assumed, about half of what hands reach in box training.
  static constexpr double kMoveSpeed = 0.8;            ///< rad/s
  static constexpr double kMoveSpeedInsertion = 0.08;  ///< m/s

  Instrument(const kinematics::TrainerArm& arm, Source source);

  // Inputs. `from` is the source that the input belongs to; any other than source() is refused.
  /// Sensed or played joints; NaN in one of the first four is refused. has_jaw false: the jaw is kept.
  Verdict sensedJoints(Source from, const Joints& q, bool has_jaw, const Joints* velocity, double now);
  /// CRTK servo_jp: all but the jaw. Limited where a joint is beyond limits().
  Verdict servoJoints(const Joints& q, bool has_fifth, double now);
  /// servo_cp of a source (crtk, teleop, haptic): tip pose in phantom_box. From crtk, Limited where the place
  /// is out of reach; of the attitude the arm has the roll alone.
  Verdict servoPose(Source from, const Eigen::Isometry3d& X_BTip, double now);
  Verdict servoJaw(Source from, double angle, double now);
  /// CRTK move_jp, move_cp and jaw/move_jp: a minimum-jerk motion; is_busy until it ends. A goal that the arm
  /// does not reach is refused.
  Verdict moveJoints(const Joints& q, bool has_fifth, double now);
  Verdict movePose(const Eigen::Isometry3d& X_BTip, double now);
  Verdict moveJaw(double angle, double now);
  /// CRTK hold: stops a move where it is, and holds it there.
  Verdict hold(double now);
  /// CRTK free: nobody holds the arm until the next command. It gives way to the forces on it (yield()).
  Verdict release(double now);
  /// Force (N) and torque (N·m) of the tissue on the tip, in phantom_box, as of now. A free arm follows it at
  /// kYield per newton, within its limits.
  void feel(const Eigen::Matrix<double, 6, 1>& wrench_B, double now);
  static constexpr double kYield = 0.02;  ///< m/s per N: so light is a free arm (assumed)

  /// enable, disable, pause, resume, home, unhome, or source:NAME. False where the word is unknown or does
  /// not fit.
  bool stateCommand(std::string_view word, double now);
  void selectSource(Source source, double now);
  /// False for the endoscope and for tools that it would take.
  bool exchangeTool(tools::ToolKind tool);
  /// Of the endoscope: angle of its optic, rad. False where it is not within [0, kOpticMost].
  bool exchangeOptic(double angle);
  static constexpr double kOpticMost = 1.6;
  void setClutch(bool pressed);

  /// Advances moves and velocities to `now`; call before reading. Velocity of sources that do not give one is
  /// the difference over the last step through a first-order low-pass of 20 ms (assumed).
  void update(double now);

  bool present() const { return arm_.present; }
  Source source() const { return source_; }
  tools::ToolKind tool() const { return tool_; }
  OperatingState operatingState() const { return state_; }
  bool homed() const { return homed_; }
  bool busy() const { return arm_move_.active || jaw_move_.active; }
  bool free() const { return free_; }
  bool valid() const { return valid_; }
  /// measured() is where the instrument is. A simulated arm knows that before its first command, and while it
  /// is paused; of other sources only what is valid() is known.
  bool known() const { return valid_ || source_ == Source::Crtk; }
  bool clutched() const { return clutched_; }
  std::uint32_t stateRevision() const { return state_revision_; }  ///< counts changes of state, homed, busy
  const Joints& measured() const { return q_; }
  const Joints& velocity() const { return qd_; }
  const Joints& setpoint() const { return setpoint_; }
  double lastInput() const { return last_input_; }  ///< s, steady; < 0 before the first
  const kinematics::TrainerArm& arm() const { return arm_; }
  kinematics::JointLimits limits() const;  ///< of the arm, with this tool
  Eigen::Isometry3d tip() const { return kinematics::forwardKinematics(arm_.X_BTrocar, fromJoints(q_)); }
  Eigen::Isometry3d setpointTip() const {
    return kinematics::forwardKinematics(arm_.X_BTrocar, fromJoints(setpoint_));
  }
  /// Fire (clip, sling, injection): the handle closed after it had been open with this tool.
  bool fires() const { return fires_; }

 private:
  /// A minimum-jerk motion of the first four joints, or of the fifth.
  struct Move {
    bool active = false;
    double start = 0.0, time = 0.0;
    Joints from = Joints::Zero(), to = Joints::Zero();
  };

  Verdict admit(Source from) const;
  Joints limited(const Joints& q) const;
  bool within(const Joints& q) const;
  void accept(const Joints& q, bool has_fifth, double now);
  void start(Move& move, const Joints& goal, int first, int last, double now);
  void advance(Move& move, int first, int last, double now);
  void yield(double now);
  void setState(OperatingState state);
  void stop();

  kinematics::TrainerArm arm_;
  Source source_;
  tools::ToolKind tool_;
  OperatingState state_ = OperatingState::Enabled;
  bool homed_ = true, valid_ = false, clutched_ = false, has_velocity_ = false;
  bool was_open_ = false, fires_ = false, rebase_ = false, free_ = false;
  std::uint32_t state_revision_ = 0;
  Joints q_, qd_ = Joints::Zero(), setpoint_, previous_;
  Move arm_move_, jaw_move_;
  Eigen::Vector3d clutch_offset_B_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 6, 1> wrench_B_ = Eigen::Matrix<double, 6, 1>::Zero();
  double last_input_ = -1.0, last_update_ = -1.0, felt_ = -1.0;
};

}  // namespace vest::control

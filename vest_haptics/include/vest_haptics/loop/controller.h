/// One tick of force feedback, from reading to output, without device, clock or thread: all of it is input.
#pragma once

#include <cstdint>
#include <string_view>

#include <Eigen/Geometry>

#include "vest_haptics/device/device.h"
#include "vest_haptics/device/sensor_check.h"
#include "vest_haptics/loop/contact_force.h"
#include "vest_haptics/loop/registration.h"
#include "vest_haptics/safety/freshness.h"
#include "vest_haptics/safety/gate.h"
#include "vest_haptics/safety/limiter.h"
#include "vest_haptics/safety/passivity.h"
#include "vest_instruments/control/instrument.h"
#include "vest_tissue/shared/contact_memory.h"
#include "vest_tissue/voxel/law.h"

namespace vest::haptics {

struct ControllerOptions {
  int instrument = 0;                                      ///< tools::Instrument: whose contact is felt
  kinematics::TrainerArm arm;                              ///< its trocar
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();  ///< phantom_box in world
  double period = 0.001;                                   ///< s
  double scale = 1.0;               ///< box metres per metre of the device; forces by virtual work
  double force_limit = 0.0;         ///< N: lowers the device's maximum; 0: leave it
  double force_gain = 1.0;          ///< contact force shown over contact force; the limits stay
  double slew_seconds = 0.025;      ///< s from zero to the maximum, ≥ 0.02: so one tick changes at most 5 %
  double configured_damping = 0.0;  ///< N·s/m: viscous damping added to the handle, always
  double hand_damping = 1.0;        ///< N·s/m that a holding hand adds: assumed, low end of what wrists have
  double trocar_friction = 0.0;     ///< N: Coulomb friction of the shaft in the trocar; 0: off
  double trocar_viscosity = 0.0;    ///< N·s/m
  bool passivity = true;
};

/// Why the controller is in FAULT.
enum class Fault : std::uint8_t { None, DeviceError, Sensor, NotFinite, ContactModel, Publisher, Clock };
std::string_view faultText(Fault fault);

struct TickInput {
  std::int64_t now_ns = 0;  ///< steady
  DeviceStatus status = DeviceStatus::Starting;
  Sample sample;
  Timing timing;                                ///< measured by the device; 0: assumed from its rate
  const shared::ContactImage* image = nullptr;  ///< newest of the shared memory, null where there is none
  voxel::View volume;                           ///< the one that the image names; none where it names none
  Eigen::Vector3d servo_force = Eigen::Vector3d::Zero();  ///< N, device frame: CRTK servo_cf
  std::int64_t servo_ns = -1;                             ///< steady, when it came; < 0: never
};

/// All that a tick found out, for publishing.
struct TickReport {
  std::int64_t now_ns = 0;
  Loads loads{};           ///< to the device
  bool forces_on = false;  ///< to the device
  control::OperatingState state = control::OperatingState::Disabled;
  Fault fault = Fault::None;
  const char* detail = "";  ///< which field of a contact model was refused last; lives for ever
  DeviceStatus status = DeviceStatus::Starting;
  bool valid = false;  ///< the pose is a measured one
  Sample sample;       ///< checked
  Eigen::Isometry3d X_BTip =
      Eigen::Isometry3d::Identity();                       ///< tip in phantom_box (haptics/NAME/measured_cp)
  Eigen::Vector3d tip_W = Eigen::Vector3d::Zero();         ///< m
  Eigen::Vector3d velocity_B = Eigen::Vector3d::Zero();    ///< m/s, of the tip in phantom_box
  Eigen::Vector3d force_true_W = Eigen::Vector3d::Zero();  ///< N: what the newest model asks for
  Eigen::Vector3d force_shown_W =
      Eigen::Vector3d::Zero();  ///< N, Cartesian equivalent of what the device shows
  double age = 0.0;             ///< s, of the contact model
  double energy = 0.0;          ///< J
  double damping = 0.0;         ///< N·s/m
  double allowance = 0.0;
  double stiffness =
      0.0;  ///< N/m at the handle: most that is shown. The measured delay lowers it at once, and
            ///< raises it only where nothing is touched: a spring that stiffens gives energy
  std::uint32_t limits = 0;    ///< LimitFlag
  std::uint64_t step = 0;      ///< of the simulation
  std::uint64_t rejected = 0;  ///< readings
};

enum class Command : std::uint8_t { Enable, Disable, Pause, Resume };

/// States as CRTK names them. FAULT is latched: only `disable` leaves it, and `enable` must follow; forces
/// come back through the gate (two seconds of ramp after small forces).
class Controller {
 public:
  Controller(const Capabilities& capabilities, const ControllerOptions& options);

  /// Real-time safe.
  const TickReport& tick(const TickInput& input) noexcept;
  /// False where it does not fit the state. Between ticks, same thread.
  bool command(Command command) noexcept;
  /// From outside, e.g. a second publisher on a safety topic.
  void raise(Fault fault) noexcept;
  control::OperatingState state() const noexcept { return report_.state; }
  const TickReport& report() const noexcept { return report_; }

 private:
  double greatest(const Timing& measured) const noexcept;
  double coupling(double stiffness) const noexcept;
  void pose(const Sample& sample) noexcept;
  Loads toDevice(const Eigen::Vector3d& force_W, const Eigen::Vector3d& torque_W,
                 double jaw_torque) const noexcept;
  void addTrocar(Loads& loads) const noexcept;
  double share(const Loads& loads) const noexcept;
  void spareMotors(Loads& loads) const noexcept;

  Capabilities capabilities_;
  ControllerOptions options_;
  Limiter limiter_;
  Gate gate_;
  Freshness freshness_;
  SensorCheck sensor_;
  Passivity passivity_;
  ContactForce contact_;
  voxel::ToolState in_volume_;
  Registration registration_;
  TickReport report_;

  bool any_ = false;
  bool present_ = false;          ///< the instrument, in the newest image
  std::uint64_t generation_ = 0;  ///< of the newest image
  std::int64_t last_ns_ = 0;
  Loads axes_{}, axis_speed_{};  ///< what passivity sees: position or joints, and its low-passed derivative
  Eigen::Vector3d own_W_ = Eigen::Vector3d::Zero();       ///< m, tip by the device alone
  Eigen::Vector3d velocity_W_ = Eigen::Vector3d::Zero();  ///< m/s
  Eigen::Vector3d torque_W_ = Eigen::Vector3d::Zero();    ///< N·m, low-passed
  double jaw_torque_ = 0.0;                               ///< N·m, low-passed
  double heat_ = 0.0;                                     ///< N²: mean square of the force shown
  Eigen::Matrix<double, 6, 4> jacobian_ = Eigen::Matrix<double, 6, 4>::Zero();
};

}  // namespace vest::haptics

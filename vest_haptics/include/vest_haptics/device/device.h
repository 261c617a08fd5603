/// What the loop knows of a force-feedback device. One small interface for all of them.
///
/// Device frame: right-handed, x to the user's right, y away from the user, z up; origin at the middle of the
/// device's workspace. Metres, radians, newtons, seconds. A five-axis device measures joints of an instrument
/// behind a trocar instead (docs/conventions.md: yaw, pitch, insertion, roll, jaw).
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "vest_haptics/safety/limiter.h"

namespace vest::haptics {

/// A device that cannot be opened; what() says what is missing and what to install, set or whom to ask.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Words of a device's configuration: library, port, serial number … Unknown keys are errors of the plug-in.
using DeviceOptions = std::map<std::string, std::string>;

struct Capabilities {
  std::string model;         ///< for people
  std::string serial;        ///< empty where the device does not tell
  bool joints = false;       ///< measures and drives joints; else a Cartesian point
  bool orientation = false;  ///< Cartesian: measures the attitude of the handle
  bool jaw = false;          ///< measures the opening of a handle
  bool force = true;         ///< can show force at all
  int buttons = 0;
  Loads maximum{};           ///< N or N·m: nominal; Cartesian: [0] is the norm's
  double continuous = 0.0;   ///< N, Cartesian: what the motors bear for ever; 0: not told
  Loads workspace{};         ///< m or rad: half width of each measured axis about its middle, for conformance
  double damping = 0.005;    ///< N·s/m: viscous damping of the bare mechanism, for the bound of Colgate
  double stiffness = 500.0;  ///< N/m: greatest stiffness the maker names
  double watchdog =
      0.0;  ///< s after the last command at which the device itself drops to zero; 0: it has none
  double rate = 1000.0;  ///< Hz: poses a second
  double delay = 0.0;    ///< s that the host cannot measure: in the device, before a pose and behind a force
};

/// How late forces are, as measured while the device runs. A force reaches the hand `delay` after the pose
/// was measured that it was computed from, and is held for `period` until that of a newer pose follows. Both
/// 0: not measured.
struct Timing {
  double period = 0.0;  ///< s, T
  double delay = 0.0;   ///< s, t_d
};

/// One reading. Fields that the capabilities deny stay at their defaults.
struct Sample {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, device frame
  Eigen::Quaterniond orientation =
      Eigen::Quaterniond::Identity();  ///< handle in device frame: z along the shaft
  Loads joints{};                      ///< yaw rad, pitch rad, insertion m, roll rad, jaw rad
  double jaw = 0.0;                    ///< rad, full opening
  std::uint32_t buttons = 0;           ///< bit i: button i is down
};

enum class DeviceStatus : std::uint8_t {
  Ok = 0,
  Starting,      ///< no sample yet
  Uncalibrated,  ///< poses are not valid; the hand must do what calibrationHint() says
  Unplugged,     ///< comes back by itself; no pose
  Error,         ///< latched until reset()
};
const char* statusName(DeviceStatus status);

/// A device. open(), close(), reset() and the texts are for one ordinary thread; read(), write() and status
/// come from the loop's thread and are real-time safe: no allocation, no lock, no wait, no exception.
class Device {
 public:
  virtual ~Device() = default;

  /// Finds and starts the device with forces off. @throws DeviceError
  virtual void open(const DeviceOptions& options) = 0;
  /// Forces off, threads ended, library released. Idempotent; also after a failed open().
  virtual void close() = 0;
  virtual const Capabilities& capabilities() const = 0;

  /// Newest reading. `sample` is untouched unless Ok.
  virtual DeviceStatus read(Sample& sample) noexcept = 0;
  /// Load on the hand (tissue on hand), already limited. Not shown while forces are off.
  virtual DeviceStatus write(const Loads& loads) noexcept = 0;
  /// Forces off is the state after open(), after any error, and after close().
  virtual void enableForces(bool on) noexcept = 0;
  /// Acknowledges an error. The status tells whether it helped.
  virtual void reset() = 0;
  /// A person holds the device as calibrationHint() says, and says so. For devices that cannot see it
  /// themselves.
  virtual void home() {}
  /// Advances a simulated device by dt seconds; real devices do nothing.
  virtual void advance(double dt) noexcept { static_cast<void>(dt); }

  virtual std::string lastError() const { return {}; }        ///< for people, of the newest error
  virtual std::string calibrationHint() const { return {}; }  ///< what the hand must do
  /// Measured by the device while it runs. Real-time safe.
  virtual Timing timing() const noexcept { return {}; }
  /// Newest error as the device numbers it, 0: none. Real-time safe.
  virtual std::uint32_t errorCode() const noexcept { return 0; }
};

/// The first number of a device that its loop must not be built on (not finite, negative, a maximum of
/// nothing or of more than any device for a hand shows), with what is allowed. Empty: all are sound.
std::string unsound(const Capabilities& capabilities);

/// Refuses keys that a plug-in does not know. @throws DeviceError naming key and what is allowed
void checkOptions(const std::string& device, const DeviceOptions& options, const std::string& allowed);
/// Value of a key, or a default.
std::string option(const DeviceOptions& options, const std::string& key, const std::string& otherwise);
/// A number within limits. @throws DeviceError
double numberOption(const DeviceOptions& options, const std::string& key, double otherwise, double least,
                    double most);

}  // namespace vest::haptics

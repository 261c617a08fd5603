#include "vest_haptics/device/force_dimension.h"

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "vest_haptics/device/realtime.h"

namespace vest::haptics {
namespace {

// x to the user, y right, z up (maker's axes) → x right, y away, z up.
Eigen::Matrix3d axes() {
  Eigen::Matrix3d r;
  r << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  return r;
}

// dhdGetStatus: places in the vector that it fills.
constexpr int kStatusPower = 0, kStatusConnected = 1, kStatusReset = 3, kStatusForce = 5, kStatusError = 9;
constexpr int kStatusPlaces = 64;  // the newest SDK fills 17

// Columns: x, y, z of the tip frame (z along the shaft to the tissue, x to the right where the wrist is at
// rest) in the maker's wrist frame, which at rest has x to the user, y right, z up.
Eigen::Matrix3d tipAxes(const std::string& shaft) {
  Eigen::Vector3d z = shaft.back() == 'x' ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  if (shaft.front() == '-') z = -z;
  Eigen::Matrix3d out;
  out << Eigen::Vector3d::UnitY(), z.cross(Eigen::Vector3d::UnitY()), z;
  return out;
}

}  // namespace

// Own declarations of what is used of the SDK: names, arguments and results are facts of its documentation.
// Calls return a negative number on failure; the last argument is the device.
struct ForceDimensionDevice::Library {
  void* handle = nullptr;
  int (*openId)(char) = nullptr;
  int (*close)(char) = nullptr;
  int (*enableForce)(unsigned char, char) = nullptr;
  int (*getPosition)(double*, double*, double*, char) = nullptr;
  int (*getFrame)(double (*)[3], char) = nullptr;
  int (*setForce)(double, double, double, char) = nullptr;
  unsigned (*getButtonMask)(char) = nullptr;
  int (*getGripperAngle)(double*, char) = nullptr;
  int (*getStatus)(int*, char) = nullptr;
  bool (*hasWrist)(char) = nullptr;
  bool (*hasGripper)(char) = nullptr;
  const char* (*systemName)(char) = nullptr;
  const char* (*lastError)() = nullptr;

  explicit Library(const std::string& file) {
    handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
      const char* why = ::dlerror();
      throw DeviceError(
          "Force Dimension: library '" + file + "' cannot be loaded (" + (why ? why : "?") +
          "). Install the Force Dimension SDK, or name the library in the device's option 'library'");
    }
    const auto find = [&](auto& function, const char* name) {
      void* symbol = ::dlsym(handle, name);
      if (!symbol)
        throw DeviceError("Force Dimension: library '" + file + "' lacks the function " + name +
                          "; allowed: libdhd 3");
      function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(symbol);
    };
    find(openId, "dhdOpenID");
    find(close, "dhdClose");
    find(enableForce, "dhdEnableForce");
    find(getPosition, "dhdGetPosition");
    find(getFrame, "dhdGetOrientationFrame");
    find(setForce, "dhdSetForce");
    find(getButtonMask, "dhdGetButtonMask");
    find(getGripperAngle, "dhdGetGripperAngleRad");
    find(getStatus, "dhdGetStatus");
    find(hasWrist, "dhdHasWrist");
    find(hasGripper, "dhdHasGripper");
    find(systemName, "dhdGetSystemName");
    find(lastError, "dhdErrorGetLastStr");
  }
  ~Library() {
    if (handle) ::dlclose(handle);
  }
};

ForceDimensionDevice::ForceDimensionDevice() {
  capabilities_.model = "Force Dimension";
  capabilities_.maximum = {8.0, 0, 0, 0, 0};
  capabilities_.workspace = {0.05, 0.05, 0.05, 0, 0};
  capabilities_.stiffness = 2000.0;
  capabilities_.buttons = 8;     // as many as the SDK's mask has had from its first release on
  capabilities_.damping = 0.05;  // assumed: parallel arms with cable drives
}

ForceDimensionDevice::~ForceDimensionDevice() {
  close();
}

void ForceDimensionDevice::open(const DeviceOptions& options) {
  checkOptions("Force Dimension", options, "library index maximum_force shaft");
  close();
  capabilities_.maximum[0] = numberOption(options, "maximum_force", 8.0, 0.1, 20.0);
  const std::string shaft = option(options, "shaft", "-x");
  if (shaft != "-x" && shaft != "x" && shaft != "-z" && shaft != "z")
    throw DeviceError("Force Dimension: option 'shaft' = '" + shaft + "'; allowed: -x, x, -z, z");
  tip_ = tipAxes(shaft);
  const char index = static_cast<char>(numberOption(options, "index", 0, 0, 15));
  dhd_ = std::make_unique<Library>(option(options, "library", "libdhd.so.3"));
  begin();
  id_ = dhd_->openId(index);
  if (id_ < 0) {
    const char* why = dhd_->lastError();
    const std::string text = why ? why : "?";
    dhd_.reset();
    throw DeviceError(
        "Force Dimension: device " + std::to_string(index) + " cannot be opened: " + text +
        ". Is it plugged in and powered, may this user open USB devices (the maker's udev rule)?");
  }
  const char* name = dhd_->systemName(static_cast<char>(id_));
  capabilities_.model = name ? name : "Force Dimension";
  capabilities_.orientation = dhd_->hasWrist(static_cast<char>(id_));
  capabilities_.jaw = dhd_->hasGripper(static_cast<char>(id_));
  if (dhd_->enableForce(0, static_cast<char>(id_)) < 0) {
    const char* why = dhd_->lastError();
    const std::string text = why ? why : "?";
    close();
    throw DeviceError("Force Dimension: the forces of device " + std::to_string(index) +
                      " cannot be switched off: " + text);
  }
  on_ = stop_ = false;
  thread_ = std::thread([this] { serve(); });
}

void ForceDimensionDevice::close() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (dhd_ && id_ >= 0) dhd_->close(static_cast<char>(id_));
  id_ = -1;
  dhd_.reset();
  setStatus(DeviceStatus::Starting);
}

void ForceDimensionDevice::reset() {
  if (errorCode() != 0) clearError();
}

// True where poses are to be believed. Errors are latched.
bool ForceDimensionDevice::askStatus(std::int64_t now_ns) noexcept {
  constexpr std::int64_t kPatience = 100000000;  // ns after which force mode must have been entered, assumed
  int status[kStatusPlaces] = {};
  if (dhd_->getStatus(status, static_cast<char>(id_)) < 0) {
    fail(kStatus);
  } else if (status[kStatusPower] == 0 || status[kStatusConnected] == 0) {
    fail(kPower);
  } else if (status[kStatusError] != 0) {
    fail(kController);
  } else if (on_ && status[kStatusForce] == 0 && now_ns - since_ > kPatience) {
    fail(kForcesOff);
  }
  return status[kStatusReset] == 0;
}

bool ForceDimensionDevice::readPose(Sample& sample) noexcept {
  const Library& d = *dhd_;
  const char id = static_cast<char>(id_);
  const Eigen::Matrix3d C = axes();
  double p[3] = {}, frame[3][3] = {}, angle = 0.0;
  if (d.getPosition(&p[0], &p[1], &p[2], id) < 0) {
    fail(kPosition);
    return false;
  }
  if (capabilities_.orientation && d.getFrame(frame, id) < 0) {
    fail(kOrientation);
    return false;
  }
  if (capabilities_.jaw && d.getGripperAngle(&angle, id) < 0) {
    fail(kGripper);
    return false;
  }
  sample.position = C * Eigen::Vector3d(p[0], p[1], p[2]);
  if (capabilities_.orientation) {
    Eigen::Matrix3d R;
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) R(r, c) = frame[r][c];
    }
    sample.orientation = Eigen::Quaterniond(Eigen::Matrix3d(C * R * tip_));
  }
  sample.jaw = std::abs(angle);  // left-handed grippers count the other way
  sample.buttons = d.getButtonMask(id);
  return true;
}

void ForceDimensionDevice::serve() noexcept {
  constexpr int kAsk = 10;  // turns between two questions for the status: 5 ms
  becomeRealTime("vest_dhd");
  const Library& d = *dhd_;
  const char id = static_cast<char>(id_);
  const Eigen::Matrix3d C = axes();
  bool calibrated = false;
  auto due = std::chrono::steady_clock::now();
  for (int turn = 0; !stop_; ++turn) {
    const std::int64_t now = steadyNow();
    if (turn % kAsk == 0) calibrated = askStatus(now);
    const bool on = forcesOn() && calibrated;
    if (on != on_) {
      on_ = on;
      since_ = now;
      if (d.enableForce(on ? 1 : 0, id) < 0) fail(kEnable);
    }
    Sample sample;
    if (readPose(sample)) {
      deliver(sample, now);
      setStatus(calibrated ? DeviceStatus::Ok : DeviceStatus::Uncalibrated);
    }
    const Loads loads = wanted(steadyNow());
    const Eigen::Vector3d f = C.transpose() * Eigen::Vector3d(loads[0], loads[1], loads[2]);
    if (d.setForce(f.x(), f.y(), f.z(), id) < 0) fail(kForce);
    due = std::max(due + std::chrono::microseconds(500), std::chrono::steady_clock::now());
    std::this_thread::sleep_until(due);
  }
  d.setForce(0.0, 0.0, 0.0, id);
  d.enableForce(0, id);
}

std::string ForceDimensionDevice::describe(std::uint32_t code) const {
  switch (code) {
    case kPosition:
      return "position cannot be read: cable, power, or the emergency switch";
    case kForce:
      return "force cannot be set: cable, power, or the emergency switch";
    case kOrientation:
      return "attitude cannot be read: cable, power, or the emergency switch";
    case kGripper:
      return "gripper cannot be read: cable, power, or the emergency switch";
    case kStatus:
      return "status cannot be read: cable, power, or the emergency switch";
    case kPower:
      return "no power, or not connected";
    case kController:
      return "the device's controller reports an error: switch it off and on again";
    case kEnable:
      return "forces cannot be switched on or off";
    case kForcesOff:
      return "the device has left its force mode: its force button was pressed, or the handle moved faster "
             "than "
             "its own limit";
    default:
      return "error " + std::to_string(code);
  }
}

}  // namespace vest::haptics

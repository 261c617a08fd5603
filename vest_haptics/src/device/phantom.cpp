#include "vest_haptics/device/phantom.h"

#include <dlfcn.h>

#include <sstream>

namespace vest::haptics {
namespace {

// Own declarations of what is used of the HD API: names and values are facts of its documentation.
using Enum = unsigned int;
constexpr Enum kCurrentButtons = 0x2000, kCurrentPosition = 0x2050, kCurrentTransform = 0x2052,
               kModelType = 0x2501, kSerialNumber = 0x2504, kCalibrationStyle = 0x2555,
               kNominalMaxForce = 0x2603, kCurrentForce = 0x2700, kForceOutput = 0x4000,
               kMaxForceClamping = 0x4001, kCalibrationOk = 0x5000, kNeedsUpdate = 0x5001;
constexpr int kStyleEncoderReset = 1, kStyleAuto = 2, kStyleInkwell = 4;
constexpr unsigned kDone = 0, kContinue = 1, kInvalidHandle = 0xffffffffu;
constexpr unsigned short kMaxPriority = 65535;
constexpr unsigned kCommError = 0x302;

struct ErrorInfo {
  unsigned code;
  int internal;
  unsigned handle;
};

// x right, y up, z to the user, mm → x right, y away, z up, m.
Eigen::Matrix3d axes() {
  Eigen::Matrix3d r;
  r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return r;
}

}  // namespace

struct PhantomDevice::Library {
  void* handle = nullptr;
  unsigned (*initDevice)(const char*) = nullptr;
  void (*disableDevice)(unsigned) = nullptr;
  void (*makeCurrent)(unsigned) = nullptr;
  void (*beginFrame)(unsigned) = nullptr;
  void (*endFrame)(unsigned) = nullptr;
  void (*getDouble)(Enum, double*) = nullptr;
  void (*getInteger)(Enum, int*) = nullptr;
  const char* (*getString)(Enum) = nullptr;
  void (*setDouble)(Enum, const double*) = nullptr;
  void (*enable)(Enum) = nullptr;
  void (*disable)(Enum) = nullptr;
  ErrorInfo (*getError)() = nullptr;
  const char* (*getErrorString)(Enum) = nullptr;
  unsigned long (*schedule)(unsigned (*)(void*), void*, unsigned short) = nullptr;
  void (*unschedule)(unsigned long) = nullptr;
  void (*setRate)(unsigned long) = nullptr;
  void (*start)() = nullptr;
  void (*stop)() = nullptr;
  Enum (*checkCalibration)() = nullptr;
  void (*updateCalibration)(Enum) = nullptr;

  ~Library() {
    if (handle) ::dlclose(handle);
  }

  explicit Library(const std::string& file) {
    handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) {
      const char* why = ::dlerror();
      throw DeviceError(
          "PHANToM: library '" + file + "' cannot be loaded (" + (why ? why : "?") +
          "). Install OpenHaptics and the device driver of 3D Systems, or name the library in the "
          "device's option 'library'");
    }
    const auto find = [&](auto& function, const char* name) {
      void* symbol = ::dlsym(handle, name);
      if (!symbol) {
        throw DeviceError("PHANToM: library '" + file + "' lacks the function " + name +
                          "; allowed: libHD of OpenHaptics 3");
      }
      function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(symbol);
    };
    find(initDevice, "hdInitDevice");
    find(disableDevice, "hdDisableDevice");
    find(makeCurrent, "hdMakeCurrentDevice");
    find(beginFrame, "hdBeginFrame");
    find(endFrame, "hdEndFrame");
    find(getDouble, "hdGetDoublev");
    find(getInteger, "hdGetIntegerv");
    find(getString, "hdGetString");
    find(setDouble, "hdSetDoublev");
    find(enable, "hdEnable");
    find(disable, "hdDisable");
    find(getError, "hdGetError");
    find(getErrorString, "hdGetErrorString");
    find(schedule, "hdScheduleAsynchronous");
    find(unschedule, "hdUnschedule");
    find(setRate, "hdSetSchedulerRate");
    find(start, "hdStartScheduler");
    find(stop, "hdStopScheduler");
    find(checkCalibration, "hdCheckCalibration");
    find(updateCalibration, "hdUpdateCalibration");
  }
};

PhantomDevice::PhantomDevice() {
  capabilities_.model = "PHANToM";
  capabilities_.orientation = true;
  capabilities_.buttons = 2;
  capabilities_.maximum = {0.5, 0, 0, 0, 0};
  // Touch and PHANToM Omni: 160 × 120 × 70 mm, 3.3 N, x stiffness 1.26 N/mm (maker's data sheet); damping:
  // order of magnitude of the mechanism, assumed.
  capabilities_.workspace = {0.08, 0.035, 0.06, 0, 0};
  capabilities_.stiffness = 1000.0;
  capabilities_.damping = 0.005;
}

PhantomDevice::~PhantomDevice() {
  close();
}

void PhantomDevice::open(const DeviceOptions& options) {
  checkOptions("PHANToM", options, "library name");
  close();
  hd_ = std::make_unique<Library>(option(options, "library", "libHD.so"));
  const std::string name = option(options, "name", "");
  const auto check = [&](const std::string& doing) {
    const ErrorInfo error = hd_->getError();
    if (error.code == 0) return;
    const char* text = hd_->getErrorString(error.code);
    std::ostringstream message;
    message << "PHANToM " << (name.empty() ? "(default device)" : "'" + name + "'") << ": " << doing << ": "
            << (text ? text : "?") << " (0x" << std::hex << error.code << ", internal " << std::dec
            << error.internal
            << "). Is it plugged in and powered, is its name the one of the maker's set-up, may this user "
               "open its port "
               "(groups dialout or plugdev; ask whoever runs this computer)?";
    close();
    throw DeviceError(message.str());
  };
  begin();
  handle_ = hd_->initDevice(name.empty() ? nullptr : name.c_str());
  check("cannot be opened");
  if (handle_ == kInvalidHandle) {
    close();
    throw DeviceError("PHANToM: the library gave no device and no error");
  }
  hd_->makeCurrent(handle_);
  const auto text = [&](Enum what) {
    const char* s = hd_->getString(what);
    return std::string(s ? s : "");
  };
  capabilities_.model = text(kModelType);
  capabilities_.serial = text(kSerialNumber);
  double force = 0.0;
  hd_->getDouble(kNominalMaxForce, &force);
  check("its maximum force cannot be read");
  if (!isFinite(force) || !(force > 0.0 && force < 100.0)) {
    close();
    throw DeviceError("PHANToM: nominal maximum force " + std::to_string(force) + " N; allowed: 0 … 100");
  }
  capabilities_.maximum[0] = force;
  int styles = 0;
  hd_->getInteger(kCalibrationStyle, &styles);
  check("its calibration style cannot be read");
  // Old devices reset their encoders by hand, later ones sit in an inkwell, the newest calibrate themselves.
  style_ = styles & kStyleAuto ? kStyleAuto : styles & kStyleInkwell ? kStyleInkwell : kStyleEncoderReset;
  hd_->enable(kMaxForceClamping);  // the maker's own clamp too, behind ours
  hd_->disable(kForceOutput);
  output_ = calibrated_ = false;
  ticks_ = 0;
  schedule();
  check("its servo loop cannot be scheduled");
  hd_->setRate(1000);
  hd_->getError();  // old drivers refuse the rate and run at 1 kHz anyway
  running_ = true;
  hd_->start();
  check("its servo loop cannot be started");
}

void PhantomDevice::schedule() {
  scheduled_ = true;
  task_ = hd_->schedule(&PhantomDevice::callback, this, kMaxPriority);
}

void PhantomDevice::close() {
  if (!hd_) return;
  if (running_) hd_->stop();
  if (scheduled_.exchange(false)) hd_->unschedule(task_);
  if (handle_ != kInvalidHandle) {
    hd_->makeCurrent(handle_);
    hd_->disable(kForceOutput);
    hd_->disableDevice(handle_);
  }
  running_ = output_ = false;
  handle_ = kInvalidHandle;
  hd_.reset();
  setStatus(DeviceStatus::Starting);
}

void PhantomDevice::reset() {
  if (!hd_ || errorCode() == 0) return;
  hd_->getError();  // what is left of the old error
  clearError();
  calibrated_ = output_ = false;
  setStatus(DeviceStatus::Starting);
  if (!scheduled_) schedule();
}

unsigned PhantomDevice::callback(void* self) {
  return static_cast<PhantomDevice*>(self)->serve();
}

// In the maker's servo thread, 1000 times a second.
unsigned PhantomDevice::serve() noexcept {
  const Library& hd = *hd_;
  const std::int64_t now = steadyNow();
  hd.makeCurrent(handle_);
  if (!calibrated_ || ++ticks_ % 100 == 0) {
    const Enum state = hd.checkCalibration();
    if (state == kNeedsUpdate) hd.updateCalibration(static_cast<Enum>(style_));
    calibrated_ = state == kCalibrationOk;
  }
  const bool output = forcesOn() && calibrated_;
  if (output != output_) {
    output ? hd.enable(kForceOutput) : hd.disable(kForceOutput);
    output_ = output;
  }
  double position[3] = {}, transform[16] = {};
  int buttons = 0;
  const Loads loads = calibrated_ ? wanted(now) : Loads{};
  const double force[3] = {loads[0], loads[2], -loads[1]};  // back into the maker's axes
  hd.beginFrame(handle_);
  hd.getDouble(kCurrentPosition, position);
  hd.getDouble(kCurrentTransform, transform);
  hd.getInteger(kCurrentButtons, &buttons);
  hd.setDouble(kCurrentForce, force);
  hd.endFrame(handle_);
  const ErrorInfo error = hd.getError();
  if (error.code != 0) {
    fail(error.code);
    const double zero[3] = {};
    hd.beginFrame(handle_);
    hd.setDouble(kCurrentForce, zero);
    hd.endFrame(handle_);
    hd.disable(kForceOutput);
    output_ = false;
    scheduled_ = false;
    return kDone;
  }
  Sample sample;
  const Eigen::Matrix3d C = axes();
  sample.position = C * (0.001 * Eigen::Vector3d(position[0], position[1], position[2]));
  Eigen::Matrix3d R;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) R(r, c) = transform[4 * c + r];
  }
  // The stylus points along −z of the maker's frame, ours along +z.
  R.col(1) = -R.col(1);
  R.col(2) = -R.col(2);
  sample.orientation = Eigen::Quaterniond(Eigen::Matrix3d(C * R));
  sample.buttons = static_cast<std::uint32_t>(buttons);
  deliver(sample, now);
  setStatus(calibrated_ ? DeviceStatus::Ok : DeviceStatus::Uncalibrated);
  return kContinue;
}

std::string PhantomDevice::describe(std::uint32_t code) const {
  const char* text = hd_ ? hd_->getErrorString(code) : nullptr;
  std::ostringstream out;
  out << (text ? text : "error") << " (0x" << std::hex << code << ")";
  if (code == kCommError) out << ": cable, power, or another program that uses the device";
  return out.str();
}

std::string PhantomDevice::calibrationHint() const {
  switch (style_) {
    case kStyleInkwell:
      return "put the stylus into the inkwell for a moment";
    case kStyleEncoderReset:
      return "hold the arm in its reset position (upper arm level, lower arm upright) and start again";
    default:
      return "move the stylus through its whole reach";
  }
}

}  // namespace vest::haptics

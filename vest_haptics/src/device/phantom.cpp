#include "vest_haptics/device/phantom.h"

#include <dlfcn.h>

#include <chrono>
#include <sstream>
#include <thread>

namespace vest::haptics {
namespace {

// Own declarations of what is used of the HD API: names and values are facts of its documentation.
using Enum = unsigned int;
constexpr Enum kCurrentButtons = 0x2000, kCurrentPosition = 0x2050, kCurrentTransform = 0x2052,
               kModelType = 0x2501, kSerialNumber = 0x2504, kCalibrationStyle = 0x2555,
               kUsableWorkspace = 0x2551, kNominalMaxStiffness = 0x2602, kNominalMaxForce = 0x2603,
               kNominalMaxContinuousForce = 0x2604, kCurrentForce = 0x2700, kForceOutput = 0x4000,
               kMaxForceClamping = 0x4001, kCalibrationOk = 0x5000, kNeedsUpdate = 0x5001;
constexpr int kStyleEncoderReset = 1, kStyleAuto = 2, kStyleInkwell = 4;
constexpr unsigned kDone = 0, kContinue = 1, kInvalidHandle = 0xffffffffu;
constexpr unsigned short kMaxPriority = 65535;
constexpr unsigned kCommError = 0x302;

// x right, y up, z to the user, mm → x right, y away, z up, m.
Eigen::Matrix3d axes() {
  Eigen::Matrix3d r;
  r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return r;
}

}  // namespace

struct PhantomDevice::Library {
  struct ErrorInfo {
    unsigned code;
    int internal;
    unsigned handle;
  };

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
  capabilities_.damping = 0.005;  // order of the mechanisms of this class; the library does not tell it
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
    const Library::ErrorInfo error = hd_->getError();
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
  try {
    readLimits();
  } catch (const DeviceError&) {
    close();
    throw;
  }
  check("its limits cannot be read");
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
  if (style_ == kStyleEncoderReset) {
    setStatus(DeviceStatus::Uncalibrated);  // until home()
    return;
  }
  start();
  check("its servo loop cannot be started");
}

void PhantomDevice::start() {
  running_ = true;
  hd_->start();
}

// The library speaks of mm, N and N/mm.
void PhantomDevice::readLimits() {
  const auto read = [&](Enum what, const char* name, double least, double most) {
    double value = 0.0;
    hd_->getDouble(what, &value);
    if (!isFinite(value) || !(value > least && value < most)) {
      throw DeviceError("PHANToM: " + std::string(name) + " " + std::to_string(value) +
                        "; allowed: " + std::to_string(least) + " … " + std::to_string(most));
    }
    return value;
  };
  capabilities_.maximum[0] = read(kNominalMaxForce, "nominal maximum force, N,", 0.0, 100.0);
  capabilities_.continuous = read(kNominalMaxContinuousForce, "maximum continuous force, N,", 0.0, 100.0);
  capabilities_.stiffness = 1000.0 * read(kNominalMaxStiffness, "maximum stiffness, N/mm,", 0.0, 1000.0);
  double box[6] = {};  // least x y z, greatest x y z
  hd_->getDouble(kUsableWorkspace, box);
  Eigen::Vector3d half;
  for (int i = 0; i < 3; ++i) {
    middle_[i] = 0.5 * (box[i] + box[3 + i]);
    half[i] = 0.5 * (box[3 + i] - box[i]);
    if (!isFinite(middle_[i]) || !(half[i] > 0.0 && half[i] < 10000.0))
      throw DeviceError("PHANToM: usable workspace of " + std::to_string(2.0 * half[i]) +
                        " mm; allowed: 0 … 20000");
  }
  capabilities_.workspace = {0.001 * half.x(), 0.001 * half.z(), 0.001 * half.y(), 0, 0};
}

// Encoders are reset before the servo loop runs, and where that has stopped. Nobody refreshes a force then.
void PhantomDevice::home() {
  if (!hd_ || style_ != kStyleEncoderReset) return;
  if (running_) hd_->stop();
  running_ = calibrated_ = output_ = false;
  setStatus(DeviceStatus::Uncalibrated);
  hd_->makeCurrent(handle_);
  hd_->disable(kForceOutput);
  hd_->updateCalibration(kStyleEncoderReset);
  const bool done = hd_->checkCalibration() == kCalibrationOk;
  const Library::ErrorInfo error = hd_->getError();
  if (error.code != 0)
    fail(error.code);
  else if (done)
    start();
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
  // The callback that latched the error ends itself a moment later: not before that is it scheduled anew.
  for (int i = 0; i < 10000 && scheduled_ && running_; ++i)
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  hd_->getError();  // what is left of the old error
  clearError();
  calibrated_ = output_ = false;
  setStatus(running_ ? DeviceStatus::Starting : DeviceStatus::Uncalibrated);
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
    // Where encoders are reset, nobody here knows the posture.
    if (state == kNeedsUpdate && style_ != kStyleEncoderReset)
      hd.updateCalibration(static_cast<Enum>(style_));
    calibrated_ = state == kCalibrationOk;
  }
  const bool output = forcesOn() && calibrated_;
  if (output != output_) {
    output ? hd.enable(kForceOutput) : hd.disable(kForceOutput);
    output_ = output;
  }
  double position[3] = {}, transform[16] = {};
  int buttons = 0;
  hd.beginFrame(handle_);
  hd.getDouble(kCurrentPosition, position);
  hd.getDouble(kCurrentTransform, transform);
  hd.getInteger(kCurrentButtons, &buttons);
  const Loads loads = calibrated_ ? wanted(steadyNow()) : Loads{};
  const double force[3] = {loads[0], loads[2], -loads[1]};  // back into the maker's axes
  hd.setDouble(kCurrentForce, force);
  hd.endFrame(handle_);
  const Library::ErrorInfo error = hd.getError();
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
  sample.position = C * (0.001 * (Eigen::Vector3d(position[0], position[1], position[2]) - middle_));
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
      return "hold the arm in its reset position (upper arm level, lower arm upright), then send 'home' on "
             "state_command";
    default:
      return "move the stylus through its whole reach";
  }
}

}  // namespace vest::haptics

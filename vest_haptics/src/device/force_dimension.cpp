#include "vest_haptics/device/force_dimension.h"

#include <dlfcn.h>

#include <chrono>

namespace vest::haptics {
namespace {

// x to the user, y right, z up (maker's axes) → x right, y away, z up.
Eigen::Matrix3d axes() {
  Eigen::Matrix3d r;
  r << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  return r;
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
  int (*getButton)(int, char) = nullptr;
  bool (*hasWrist)(char) = nullptr;
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
    find(getButton, "dhdGetButton");
    find(hasWrist, "dhdHasWrist");
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
  capabilities_.buttons = 1;
  capabilities_.damping = 0.05;  // assumed: parallel arms with cable drives
}

ForceDimensionDevice::~ForceDimensionDevice() {
  close();
}

void ForceDimensionDevice::open(const DeviceOptions& options) {
  checkOptions("Force Dimension", options, "library index maximum_force");
  close();
  capabilities_.maximum[0] = numberOption(options, "maximum_force", 8.0, 0.1, 20.0);
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
  dhd_->enableForce(0, static_cast<char>(id_));
  stop_ = false;
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

void ForceDimensionDevice::serve() noexcept {
  const Library& d = *dhd_;
  const char id = static_cast<char>(id_);
  const Eigen::Matrix3d C = axes();
  bool on = false;
  auto due = std::chrono::steady_clock::now();
  while (!stop_) {
    const std::int64_t now = steadyNow();
    if (forcesOn() != on) {
      on = !on;
      d.enableForce(on ? 1 : 0, id);
    }
    double p[3] = {}, frame[3][3] = {};
    if (d.getPosition(&p[0], &p[1], &p[2], id) < 0) {
      fail(kPosition);
    } else if (capabilities_.orientation && d.getFrame(frame, id) < 0) {
      fail(kOrientation);
    } else {
      Sample sample;
      sample.position = C * Eigen::Vector3d(p[0], p[1], p[2]);
      if (capabilities_.orientation) {
        Eigen::Matrix3d R;
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < 3; ++c) R(r, c) = frame[r][c];
        }
        sample.orientation = Eigen::Quaterniond(Eigen::Matrix3d(C * R));
      }
      sample.buttons = d.getButton(0, id) > 0 ? 1u : 0u;
      deliver(sample, now);
      setStatus(DeviceStatus::Ok);
    }
    const Loads loads = wanted(now);
    const Eigen::Vector3d f = C.transpose() * Eigen::Vector3d(loads[0], loads[1], loads[2]);
    if (d.setForce(f.x(), f.y(), f.z(), id) < 0) fail(kForce);
    std::this_thread::sleep_until(due += std::chrono::microseconds(500));
  }
  d.setForce(0.0, 0.0, 0.0, id);
  d.enableForce(0, id);
}

std::string ForceDimensionDevice::describe(std::uint32_t code) const {
  const char* what = code == kPosition ? "position cannot be read"
                     : code == kForce  ? "force cannot be set"
                                       : "attitude cannot be read";
  return std::string(what) + ": cable, power, or the emergency switch";
}

}  // namespace vest::haptics

// Devices of the kernel, through libevdev: it also finds the way back after an overflow of the kernel's
// queue.
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <libevdev/libevdev.h>
#include <unistd.h>

#include "vest_hw_phantom_box/events/event_source.h"

namespace vest::events {
namespace {

class KernelSource : public EventSource {
 public:
  KernelSource(int descriptor, const std::string& label, bool grab) : descriptor_(descriptor) {
    const int failed = libevdev_new_from_fd(descriptor, &device_);
    if (failed < 0) {
      ::close(descriptor);
      throw DeviceError(label + ": no event device (" + std::strerror(-failed) +
                        "); allowed: /dev/input/event* or /dev/input/by-id/*-event-*");
    }
    if (grab && libevdev_grab(device_, LIBEVDEV_GRAB) < 0) {
      libevdev_free(device_);
      ::close(descriptor);
      throw DeviceError(label +
                        ": another program has it for itself; end that program, or say 'grab: false'");
    }
  }
  KernelSource(const KernelSource&) = delete;
  KernelSource& operator=(const KernelSource&) = delete;
  ~KernelSource() override {
    libevdev_free(device_);  // lets go of the grab
    ::close(descriptor_);
  }
  Read next(Event& event, double) override {
    input_event in{};
    const unsigned how = syncing_ ? LIBEVDEV_READ_FLAG_SYNC : LIBEVDEV_READ_FLAG_NORMAL;
    const int status = libevdev_next_event(device_, how, &in);
    if (status == -EAGAIN) {
      if (!syncing_) return Read::Nothing;
      syncing_ = false;  // what changed in the gap has been told: go on with what came after it
      return next(event, 0.0);
    }
    if (status < 0) return status == -EINTR ? Read::Nothing : Read::Gone;
    if (status == LIBEVDEV_READ_STATUS_SYNC) syncing_ = true;
    event = {in.type, in.code, in.value};
    return Read::Event;
  }
  bool hasKey(std::uint16_t code) const override { return libevdev_has_event_code(device_, EV_KEY, code); }
  bool keyDown(std::uint16_t code) const override {
    return libevdev_get_event_value(device_, EV_KEY, code) != 0;
  }
  std::optional<AxisRange> axis(std::uint16_t code) const override {
    const input_absinfo* info = libevdev_get_abs_info(device_, code);
    if (info == nullptr) return std::nullopt;
    return AxisRange{info->minimum, info->maximum, info->flat, info->value};
  }
  std::string name() const override {
    const char* name = libevdev_get_name(device_);
    return name != nullptr ? name : "";
  }

 private:
  int descriptor_;
  libevdev* device_ = nullptr;
  bool syncing_ = false;
};

std::optional<std::uint16_t> code(unsigned type, const std::string& name) {
  const int found = libevdev_event_code_from_name(type, name.c_str());
  if (found < 0) return std::nullopt;
  return static_cast<std::uint16_t>(found);
}

int openPath(const std::string& path) {
  return ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
}

constexpr const char* kPermission = "; 'sudo adduser USER input' and a new login mend that";

}  // namespace

std::optional<std::uint16_t> keyCode(const std::string& name) {
  return code(EV_KEY, name);
}

std::optional<std::uint16_t> axisCode(const std::string& name) {
  return code(EV_ABS, name);
}

std::unique_ptr<EventSource> openKernelDevice(int descriptor, const std::string& label, bool grab) {
  return std::make_unique<KernelSource>(descriptor, label, grab);
}

std::unique_ptr<EventSource> openKernelDevice(const std::string& path, bool grab) {
  const int descriptor = openPath(path);
  if (descriptor < 0)
    throw DeviceError(path + ": " + std::strerror(errno) +
                      (errno == EACCES ? kPermission : "; plug the device in, or mend the path"));
  return openKernelDevice(descriptor, path, grab);
}

std::unique_ptr<EventSource> openSource(const control::EventDevice& device, const std::string& folder) {
  if (!device.recording.empty()) return openRecording(device.recording);
  if (!device.path.empty()) return openKernelDevice(device.path, device.grab);
  std::string seen, locked;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    if (entry.path().filename().string().rfind("event", 0) != 0) continue;
    const int descriptor = openPath(entry.path());
    if (descriptor < 0) {
      if (errno == EACCES) locked = kPermission;
      continue;
    }
    try {
      auto source = openKernelDevice(descriptor, entry.path(), false);
      if (source->name().find(device.match) != std::string::npos) {
        source.reset();
        return openKernelDevice(entry.path(), device.grab);
      }
      seen += (seen.empty() ? "" : ", ") + source->name();
    } catch (const DeviceError&) {  // not an event device: not the one that is looked for
    }
  }
  throw DeviceError("input device '" + device.name + "': no device in " + folder + " has '" + device.match +
                    "' in its name; plug it in (there: " + (seen.empty() ? "none that can be read" : seen) +
                    ")" + locked);
}

}  // namespace vest::events

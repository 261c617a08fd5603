/// A device of the kernel's event interface without a kernel: events come through a socket, and the calls of
/// ioctl that libevdev makes on it are answered here. Include in one file of an executable.
#pragma once

#include <cstdarg>
#include <cstring>
#include <map>
#include <set>
#include <string>

#include <linux/input.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace vest::testing {

/// One at a time.
class FakeEvdev {
 public:
  std::string name = "VEST test pad";
  std::set<int> keys, down;
  std::map<int, input_absinfo> axes;
  bool grabbed = false, grab_refused = false;

  FakeEvdev() {
    ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends_);
    device_ = this;
  }
  ~FakeEvdev() {
    if (ends_[1] >= 0) ::close(ends_[1]);
    device_ = nullptr;
  }
  /// Whoever opens the device takes this over.
  int descriptor() const { return ends_[0]; }
  void send(int type, int code, int value) {
    input_event e{};
    e.type = static_cast<__u16>(type);
    e.code = static_cast<__u16>(code);
    e.value = value;
    if (::write(ends_[1], &e, sizeof e) != sizeof e) std::abort();
  }
  void report() { send(EV_SYN, SYN_REPORT, 0); }
  /// Reading then fails, as with ENODEV from the kernel (a socket with something unread says ECONNRESET).
  void unplug() {
    const char unread = 0;
    if (ends_[1] >= 0 && ::write(ends_[0], &unread, 1) == 1) ::close(ends_[1]);
    ends_[1] = -1;
  }
  /// Answers as the kernel does; `known` false: not ours.
  static int answer(int descriptor, unsigned long request, void* data, bool& known) {
    known = device_ != nullptr && descriptor == device_->ends_[0] && _IOC_TYPE(request) == 'E';
    return known ? device_->reply(static_cast<int>(_IOC_NR(request)), _IOC_SIZE(request), data) : 0;
  }

 private:
  int reply(int number, std::size_t size, void* data) {
    auto* bytes = static_cast<unsigned char*>(data);
    const auto bits = [&](const auto& set) {
      std::memset(bytes, 0, size);
      for (const int b : set) {
        if (static_cast<std::size_t>(b / 8) < size) bytes[b / 8] |= static_cast<unsigned char>(1 << b % 8);
      }
      return static_cast<int>(size);
    };
    if (number == 0x90) {  // EVIOCGRAB
      if (data != nullptr && grab_refused) return errno = EBUSY, -1;
      grabbed = data != nullptr;
      return 0;
    }
    if (number >= 0x40 && number < 0x40 + ABS_CNT) {  // EVIOCGABS
      std::memcpy(data, &axes[number - 0x40], sizeof(input_absinfo));
      return 0;
    }
    if (number == 0x18) return bits(down);  // EVIOCGKEY
    if (number == 0x20) {                   // EVIOCGBIT(0): kinds of events
      return bits(std::set<int>{EV_SYN, EV_KEY, EV_ABS});
    }
    if (number == 0x20 + EV_KEY) return bits(keys);
    if (number == 0x20 + EV_ABS) {
      std::set<int> codes;
      for (const auto& [code, info] : axes) codes.insert(code);
      return bits(codes);
    }
    if (number == 0x06) {  // EVIOCGNAME
      std::strncpy(static_cast<char*>(data), name.c_str(), size);
      return static_cast<int>(name.size()) + 1;
    }
    if (number == 0x07 || number == 0x08) return errno = ENOENT, -1;  // no place, no serial number
    if (size != 0 && data != nullptr) std::memset(data, 0, size);  // version, id, properties, LEDs, switches
    return 0;
  }

  static inline FakeEvdev* device_ = nullptr;
  int ends_[2]{-1, -1};
};

}  // namespace vest::testing

// In front of the C library's: libevdev asks through it.
extern "C" int ioctl(int descriptor, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* data = va_arg(list, void*);
  va_end(list);
  bool known = false;
  const int answer = vest::testing::FakeEvdev::answer(descriptor, request, data, known);
  return known ? answer : static_cast<int>(::syscall(SYS_ioctl, descriptor, request, data));
}

// A stand-in for libHD with the same C functions: a simulated arm, every error on command, and checks that
// calls come in the documented order and inside frames. For tests and for people without a device.
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "vest_haptics/device/simulated.h"

namespace {

using vest::haptics::HandAxis;
struct ErrorInfo {
  unsigned code;
  int internal;
  unsigned handle;
};

struct Fake {
  std::recursive_mutex mutex;
  HandAxis axis[3];  // m, maker's axes: x right, y up, z to the user
  double wish[3] = {}, force[3] = {}, pending[3] = {};
  bool open = false, frame = false, output = false, started = false, current = false, manual = false;
  struct Task {
    unsigned (*callback)(void*);
    void* user;
  };
  std::mutex tasks_mutex;  // never held while a callback runs: it may be followed by another at any moment
  std::map<unsigned long, Task> tasks;
  unsigned long handles = 5;
  std::atomic<unsigned> error{0};
  unsigned calibration = 0x5000;
  double reset_at[3] =
      {};  // where the arm was when its encoders were reset: the library takes it for the posture
  void (*hook)(void*) = nullptr;
  void* hook_user = nullptr;
  std::string hook_at;
  int styles = 2, updates = 0, buttons = 0;
  double nominal = 3.3, continuous = 0.88, stiffness = 1.26;  // N, N, N/mm: of a Touch
  double box[6] = {-80, -60, -35, 80, 60, 35};                // mm
  std::map<std::string, int> calls, fail_after;
  std::map<std::string, unsigned> fail_code;
  int violations = 0;
  std::string violation;
  std::thread thread;
  std::atomic<bool> stop{false};
  bool ever_scheduled = false;

  void wrong(const std::string& what) {
    ++violations;
    if (violation.empty()) violation = what;
  }
  void called(const char* name) {
    ++calls[name];
    const auto it = fail_code.find(name);
    if (it != fail_code.end() && --fail_after[name] < 0) {
      error = it->second;
      fail_code.erase(it);
    }
    if (hook && hook_at == name) {
      auto* const now = hook;
      hook = nullptr;
      now(hook_user);
    }
  }
  bool scheduled() {
    std::lock_guard<std::mutex> lock(tasks_mutex);
    return !tasks.empty();
  }
  void tick() {
    std::lock_guard<std::recursive_mutex> lock(mutex);
    std::map<unsigned long, Task> due;
    {
      std::lock_guard<std::mutex> other(tasks_mutex);
      due = tasks;
    }
    for (const auto& [handle, task] : due) {
      if (task.callback(task.user) != 0) continue;
      std::lock_guard<std::mutex> other(tasks_mutex);
      tasks.erase(handle);
    }
    if (frame) wrong("callback returned inside a frame");
    for (int i = 0; i < 3; ++i) {
      axis[i].advance(output ? force[i] : 0.0, wish[i], 0.0, 0.001);
    }
  }
};

Fake& it() {
  static Fake fake;
  return fake;
}

#define ENTER(name)                                       \
  std::lock_guard<std::recursive_mutex> lock(it().mutex); \
  it().called(#name)

bool needsFrame(unsigned what) {
  return what == 0x2000 || (what >= 0x2050 && what <= 0x2150) || what == 0x2700;
}

}  // namespace

extern "C" {

unsigned hdInitDevice(const char* name) {
  ENTER(hdInitDevice);
  if (it().error) return 0xffffffffu;
  if (name && std::strcmp(name, "missing") == 0) {
    it().error = 0x300;
    return 0xffffffffu;
  }
  if (it().open) it().wrong("hdInitDevice twice");
  it().open = true;
  it().current = true;
  return 1;
}
void hdDisableDevice(unsigned) {
  ENTER(hdDisableDevice);
  if (it().started) it().wrong("hdDisableDevice while the scheduler runs");
  if (it().scheduled()) it().wrong("hdDisableDevice with a callback scheduled");
  it().open = it().current = it().output = false;
}
void hdMakeCurrentDevice(unsigned handle) {
  ENTER(hdMakeCurrentDevice);
  if (handle != 1) it().wrong("hdMakeCurrentDevice with an unknown handle");
  it().current = true;
}
unsigned hdGetCurrentDevice() {
  return 1;
}
void hdBeginFrame(unsigned) {
  ENTER(hdBeginFrame);
  if (it().frame) it().wrong("hdBeginFrame inside a frame");
  it().frame = true;
  std::memcpy(it().pending, it().force, sizeof it().force);
}
void hdEndFrame(unsigned) {
  ENTER(hdEndFrame);
  if (!it().frame) it().wrong("hdEndFrame without hdBeginFrame");
  it().frame = false;
  std::memcpy(it().force, it().pending, sizeof it().force);
}
void hdGetDoublev(unsigned what, double* out) {
  ENTER(hdGetDoublev);
  if (!it().current) it().wrong("hdGetDoublev without a current device");
  if (needsFrame(what) && !it().frame) it().wrong("hdGetDoublev outside a frame");
  if (what == 0x2603) *out = it().nominal;
  if (what == 0x2604) *out = it().continuous;
  if (what == 0x2602) *out = it().stiffness;
  if (what == 0x2551) std::memcpy(out, it().box, sizeof it().box);
  if (what == 0x2050) {
    for (int i = 0; i < 3; ++i) out[i] = 1000.0 * (it().axis[i].x - it().reset_at[i]);
  }
  if (what == 0x2052) {
    std::memset(out, 0, 16 * sizeof *out);
    // Stylus straight down: −z of its frame is −y.
    out[0] = 1.0;
    out[6] = -1.0;
    out[9] = 1.0;
    out[15] = 1.0;
    for (int i = 0; i < 3; ++i) out[12 + i] = 1000.0 * it().axis[i].x;
  }
}
void hdGetIntegerv(unsigned what, int* out) {
  ENTER(hdGetIntegerv);
  if (needsFrame(what) && !it().frame) it().wrong("hdGetIntegerv outside a frame");
  if (what == 0x2000) *out = it().buttons;
  if (what == 0x2555) *out = it().styles;
}
const char* hdGetString(unsigned what) {
  ENTER(hdGetString);
  return what == 0x2501 ? "Fake PHANToM" : what == 0x2504 ? "FAKE-1" : "";
}
void hdSetDoublev(unsigned what, const double* in) {
  ENTER(hdSetDoublev);
  if (what != 0x2700) return;
  if (!it().frame) it().wrong("force set outside a frame");
  double square = 0.0;
  for (int i = 0; i < 3; ++i) {
    it().pending[i] = in[i];
    square += in[i] * in[i];
  }
  if (!(std::sqrt(square) <= it().nominal * (1 + 1e-9)))
    it().wrong("force beyond the maximum, or not finite");
  if (it().calibration != 0x5000 && square > 0.0) it().wrong("force while not calibrated");
}
void hdEnable(unsigned what) {
  ENTER(hdEnable);
  if (what != 0x4000) return;
  if (it().calibration != 0x5000) it().wrong("force output enabled before calibration");
  it().output = true;
}
void hdDisable(unsigned what) {
  ENTER(hdDisable);
  if (what == 0x4000) it().output = false;
}
ErrorInfo hdGetError() {
  const unsigned code = it().error.exchange(0);  // waits for no callback
  return {code, code ? 7 : 0, 1};
}
const char* hdGetErrorString(unsigned code) {
  return code == 0x302 ? "communication error" : "fake error";
}
unsigned long hdScheduleAsynchronous(unsigned (*callback)(void*), void* user, unsigned short priority) {
  Fake& f = it();
  if (f.fail_code.count("hdScheduleAsynchronous")) {
    ENTER(hdScheduleAsynchronous);
  }
  std::lock_guard<std::mutex> lock(f.tasks_mutex);
  f.ever_scheduled = true;
  if (!f.open) f.wrong("hdScheduleAsynchronous without a device");
  if (priority != 65535) f.wrong("forces must be set at the highest priority");
  f.tasks[++f.handles] = {callback, user};
  return f.handles;
}
void hdUnschedule(unsigned long handle) {
  ENTER(hdUnschedule);
  std::lock_guard<std::mutex> other(it().tasks_mutex);
  if (it().tasks.erase(handle) == 0) it().wrong("hdUnschedule with an unknown handle");
}
void hdSetSchedulerRate(unsigned long rate) {
  ENTER(hdSetSchedulerRate);
  if (rate != 1000) it().wrong("scheduler rate is not 1000 Hz");
}
void hdStartScheduler() {
  const bool fails = it().fail_code.count("hdStartScheduler") > 0;
  ENTER(hdStartScheduler);
  if (it().started) it().wrong("scheduler started twice");
  if (!it().ever_scheduled) it().wrong("scheduler started before anything was scheduled");
  it().started = true;
  it().stop = false;
  if (it().manual || fails) return;  // what did not start calls nobody
  it().thread = std::thread([] {
    auto due = std::chrono::steady_clock::now();
    while (!it().stop) {
      it().tick();
      std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    }
  });
}
void hdStopScheduler() {
  {
    ENTER(hdStopScheduler);
    if (!it().started) it().wrong("scheduler stopped without a start");
    it().started = false;
    it().stop = true;
  }
  if (it().thread.joinable()) it().thread.join();
}
unsigned hdCheckCalibration() {
  ENTER(hdCheckCalibration);
  return it().calibration;
}
void hdUpdateCalibration(unsigned style) {
  ENTER(hdUpdateCalibration);
  if (!(it().styles & static_cast<int>(style))) it().wrong("calibration style that the device does not have");
  if (it().frame) it().wrong("calibration inside a frame");
  if (style == 1) {
    // Whatever the posture is; the maker's pages do it before the servo loop runs.
    if (it().started) it().wrong("encoders reset while the scheduler runs");
    for (int i = 0; i < 3; ++i) it().reset_at[i] = it().axis[i].x;
    it().calibration = 0x5000;
  } else if (!it().started) {
    it().wrong("inkwell or automatic calibration before the scheduler runs");
  }
  if (++it().updates >= 3) it().calibration = 0x5000;
}

// For tests.
void fakehd_reset() {
  Fake& f = it();
  std::lock_guard<std::recursive_mutex> lock(f.mutex);
  for (int i = 0; i < 3; ++i) {
    f.axis[i] = HandAxis{};
    f.wish[i] = f.force[i] = f.pending[i] = f.reset_at[i] = 0.0;
  }
  f.open = f.frame = f.output = f.started = f.current = f.manual = f.ever_scheduled = false;
  f.tasks.clear();
  f.hook = nullptr;
  f.calibration = 0x5000;
  f.error = 0;
  f.styles = 2;
  f.updates = f.buttons = f.violations = 0;
  f.nominal = 3.3;
  f.continuous = 0.88;
  f.stiffness = 1.26;
  f.box[3] = 80;
  f.calls.clear();
  f.fail_after.clear();
  f.fail_code.clear();
  f.violation.clear();
}
void fakehd_manual() {
  it().manual = true;
}
void fakehd_step(int n) {
  for (int i = 0; i < n; ++i) it().tick();
}
/// From the call number `after` (0: the next) on, function sets this error once.
void fakehd_fail(const char* function, unsigned code, int after) {
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  it().fail_code[function] = code;
  it().fail_after[function] = after;
}
void fakehd_calibration(unsigned state, int styles) {
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  it().calibration = state;
  it().styles = styles;
  it().updates = 0;
}
void fakehd_wish(double x, double y, double z) {  // m, maker's axes
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  it().wish[0] = x;
  it().wish[1] = y;
  it().wish[2] = z;
}
void fakehd_limits(double nominal, double continuous, double stiffness, double width) {
  it().nominal = nominal;
  it().continuous = continuous;
  it().stiffness = stiffness;
  it().box[3] = it().box[0] + width;
}
/// Where the person holds the arm, m, maker's axes.
void fakehd_hold(double x, double y, double z) {
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  const double at[3] = {x, y, z};
  for (int i = 0; i < 3; ++i) it().axis[i].x = it().wish[i] = at[i], it().axis[i].v = 0.0;
}
/// Called once within the next call of a function.
void fakehd_hook(const char* function, void (*hook)(void*), void* user) {
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  it().hook_at = function;
  it().hook_user = user;
  it().hook = hook;
}
int fakehd_started() {
  return it().started;
}
void fakehd_shown(double* out) {  // N, maker's axes: what acts on the hand
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  for (int i = 0; i < 3; ++i) out[i] = it().output ? it().force[i] : 0.0;
}
int fakehd_output() {
  return it().output;
}
int fakehd_calls(const char* name) {
  std::lock_guard<std::recursive_mutex> lock(it().mutex);
  return it().calls[name];
}
int fakehd_violations() {
  return it().violations;
}
const char* fakehd_violation() {
  return it().violation.c_str();
}

}  // extern "C"

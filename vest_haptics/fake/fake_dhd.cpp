// A stand-in for libdhd with the same C functions and a simulated arm behind them, which behaves as the
// maker's documentation says: modes RESET, IDLE, BRAKE and FORCE, a limit of speed and a button that leave
// the force mode, results that are not 0 and no errors either. For tests, and for people without a device.
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>

#include "vest_haptics/device/simulated.h"

namespace {

// Results that are no errors.
constexpr int kTimeGuard = 1, kMotorSaturated = 2;
constexpr int kMaxStatus = 17;
constexpr double kSaturation = 8.0, kSpeedLimit = 2.0;  // N, m/s

struct Fake {
  std::mutex mutex;
  vest::haptics::HandAxis axis[3];
  double force[3] = {}, wish[3] = {};
  double frame[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, gripper = 0.0;
  bool open = false, absent = false, wrist = false, has_gripper = false;
  bool reset = false, forcing = false, power = true, error = false;
  unsigned buttons = 0;
  std::atomic<int> fail_position{0}, fail_force{0}, fail_enable{0}, fail_status{0}, fail_frame{0},
      fail_gripper{0};
  std::atomic<int> policy{-1};
  int violations = 0;
  std::chrono::steady_clock::time_point last;
};
Fake& it() {
  static Fake f;
  return f;
}

bool failing(std::atomic<int>& left) {
  return left > 0 && left-- > 0;
}

}  // namespace

extern "C" {
int dhdOpenID(char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  if (it().absent) return -1;
  it().violations += it().open;
  it().open = true;
  it().forcing = false;  // in BRAKE mode
  it().last = std::chrono::steady_clock::now();
  return 3;
}
int dhdClose(char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().violations += id != 3 || !it().open || it().forcing;
  it().open = false;
  return 0;
}
int dhdEnableForce(unsigned char on, char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  if (failing(it().fail_enable)) return -1;
  // A device that is not calibrated stays in RESET mode, and no motor gets current.
  it().forcing = on != 0 && !it().reset;
  it().violations += on != 0 && it().reset;
  return 0;
}
int dhdGetStatus(int* status, char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  if (failing(it().fail_status)) return -1;
  it().violations += id != 3 || !it().open;
  for (int i = 0; i < kMaxStatus; ++i) status[i] = 0;
  status[0] = it().power;
  status[1] = status[2] = 1;
  status[3] = it().reset;
  status[5] = it().forcing;
  status[6] = !it().forcing && !it().reset;
  status[8] = it().wrist;
  status[9] = it().error;
  status[10] = status[11] = 1;  // gravity compensation, TimeGuard
  return 0;
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().violations += id != 3 || !it().open;
  if (failing(it().fail_position)) return -1;
  const auto now = std::chrono::steady_clock::now();
  double dt = std::chrono::duration<double>(now - it().last).count();
  it().last = now;
  const bool guarded = dt < 1e-4;
  dt = dt > 0.02 ? 0.02 : dt;
  for (int i = 0; i < 3; ++i) {
    it().axis[i].advance(it().forcing ? it().force[i] : 0.0, it().wish[i], 0.0, dt);
    // Faster than the limit of the controller: it brakes, and stays so until forces are enabled again.
    if (std::abs(it().axis[i].v) > kSpeedLimit) it().forcing = false;
  }
  *x = it().axis[0].x;
  *y = it().axis[1].x;
  *z = it().axis[2].x;
  return guarded ? kTimeGuard : 0;
}
int dhdGetOrientationFrame(double m[3][3], char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  if (failing(it().fail_frame)) return -1;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m[r][c] = it().frame[r][c];
  }
  return kTimeGuard;
}
int dhdGetGripperAngleRad(double* angle, char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  if (failing(it().fail_gripper) || !it().has_gripper) return -1;
  *angle = it().gripper;
  return 0;
}
int dhdSetForce(double x, double y, double z, char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  sched_param unused{};
  int policy = -1;
  ::pthread_getschedparam(::pthread_self(), &policy, &unused);
  it().policy = policy;
  it().violations += id != 3 || !it().open || !(std::hypot(x, y, z) <= kSaturation * (1 + 1e-9));
  if (failing(it().fail_force)) return -1;
  it().force[0] = x;
  it().force[1] = y;
  it().force[2] = z;
  return std::hypot(x, y, z) > 0.99 * kSaturation ? kMotorSaturated : 0;
}
unsigned dhdGetButtonMask(char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  return it().buttons;
}
bool dhdHasWrist(char) {
  return it().wrist;
}
bool dhdHasGripper(char) {
  return it().has_gripper;
}
const char* dhdGetSystemName(char) {
  return "Fake omega";
}
const char* dhdErrorGetLastStr() {
  return "no device";
}

// For tests.
void fakedhd_reset() {
  Fake& f = it();
  std::lock_guard<std::mutex> lock(f.mutex);
  for (int i = 0; i < 3; ++i) {
    f.axis[i] = vest::haptics::HandAxis{};
    f.force[i] = f.wish[i] = 0.0;
    for (int j = 0; j < 3; ++j) f.frame[i][j] = i == j;
  }
  f.absent = f.wrist = f.has_gripper = f.reset = f.forcing = f.error = false;
  f.power = true;
  f.gripper = 0.0;
  f.buttons = 0;
  f.violations = 0;
  f.fail_position = f.fail_force = f.fail_enable = f.fail_status = f.fail_frame = f.fail_gripper = 0;
}
/// The next call of a function fails: position, force, enable, status, frame, gripper.
void fakedhd_fail(const char* what) {
  Fake& f = it();
  (what[0] == 'p'   ? f.fail_position
   : what[0] == 'e' ? f.fail_enable
   : what[0] == 's' ? f.fail_status
   : what[0] == 'g' ? f.fail_gripper
   : what[1] == 'o' ? f.fail_force
                    : f.fail_frame) = 1;
}
void fakedhd_absent(int absent) {
  it().absent = absent != 0;
}
/// The person: takes the device out of its calibration, presses its force button, pulls its plug.
void fakedhd_mode(int reset, int power, int error) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().reset = reset != 0;
  it().power = power != 0;
  it().error = error != 0;
  if (it().reset || !it().power || it().error) it().forcing = false;
}
void fakedhd_force_button() {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().forcing = false;
}
void fakedhd_push(double speed) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().axis[2].v = speed;
}
void fakedhd_handle(int wrist, const double* frame, int has_gripper, double angle, unsigned buttons) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().wrist = wrist != 0;
  it().has_gripper = has_gripper != 0;
  it().gripper = angle;
  it().buttons = buttons;
  for (int i = 0; i < 9; ++i) it().frame[i / 3][i % 3] = frame[i];
}
void fakedhd_wish(double x, double y, double z) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().wish[0] = x;
  it().wish[1] = y;
  it().wish[2] = z;
}
void fakedhd_shown(double* out) {
  std::lock_guard<std::mutex> lock(it().mutex);
  for (int i = 0; i < 3; ++i) out[i] = it().forcing ? it().force[i] : 0.0;
}
int fakedhd_policy() {
  return it().policy;
}
int fakedhd_violations() {
  return it().violations;
}
}

// A stand-in for libdhd with the same C functions and a simulated arm behind them. For tests, and for people
// without a device.
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>

#include "vest_haptics/device/simulated.h"

namespace {
struct Fake {
  std::mutex mutex;
  vest::haptics::HandAxis axis[3];
  double force[3] = {}, wish[3] = {};
  bool open = false, on = false, absent = false;
  std::atomic<int> fail_position{0}, fail_force{0};
  int violations = 0;
  std::chrono::steady_clock::time_point last;
};
Fake& it() {
  static Fake f;
  return f;
}
}  // namespace

extern "C" {
int dhdOpenID(char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  if (it().absent) return -1;
  it().violations += it().open;
  it().open = true;
  it().on = false;
  it().last = std::chrono::steady_clock::now();
  return 3;
}
int dhdClose(char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().violations += id != 3 || !it().open || it().on;
  it().open = false;
  return 0;
}
int dhdEnableForce(unsigned char on, char) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().on = on != 0;
  return 0;
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().violations += id != 3 || !it().open;
  if (it().fail_position > 0 && it().fail_position-- > 0) return -1;
  const auto now = std::chrono::steady_clock::now();
  double dt = std::chrono::duration<double>(now - it().last).count();
  it().last = now;
  dt = dt > 0.02 ? 0.02 : dt;
  for (int i = 0; i < 3; ++i) it().axis[i].advance(it().on ? it().force[i] : 0.0, it().wish[i], 0.0, dt);
  *x = it().axis[0].x;
  *y = it().axis[1].x;
  *z = it().axis[2].x;
  return 0;
}
int dhdGetOrientationFrame(double m[3][3], char) {
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) m[r][c] = r == c;
  }
  return 0;
}
int dhdSetForce(double x, double y, double z, char id) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().violations += id != 3 || !it().open || !(std::hypot(x, y, z) <= 8.0 * (1 + 1e-9));
  if (it().fail_force > 0 && it().fail_force-- > 0) return -1;
  it().force[0] = x;
  it().force[1] = y;
  it().force[2] = z;
  return 0;
}
int dhdGetButton(int, char) {
  return 0;
}
bool dhdHasWrist(char) {
  return false;
}
const char* dhdGetSystemName(char) {
  return "Fake omega";
}
const char* dhdErrorGetLastStr() {
  return "no device";
}

// For tests.
void fakedhd_fail(int positions, int forces) {
  it().fail_position = positions;
  it().fail_force = forces;
}
void fakedhd_absent(int absent) {
  it().absent = absent != 0;
}
void fakedhd_wish(double x, double y, double z) {
  std::lock_guard<std::mutex> lock(it().mutex);
  it().wish[0] = x;
  it().wish[1] = y;
  it().wish[2] = z;
}
void fakedhd_shown(double* out) {
  std::lock_guard<std::mutex> lock(it().mutex);
  for (int i = 0; i < 3; ++i) out[i] = it().on ? it().force[i] : 0.0;
}
int fakedhd_violations() {
  return it().violations;
}
}

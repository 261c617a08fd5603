#pragma once

#include <cmath>
#include <memory>

#include "support.h"
#include "vest_haptics/device/simulated.h"

namespace vest::haptics::testing {

/// A simulated device, a half space, a controller: closed loop on an injected clock.
struct Bench {
  SimulatedDevice device;
  HalfSpace tissue;
  ControllerOptions options;
  std::unique_ptr<Controller> controller;
  std::int64_t now = 1000 * kMs;
  bool alive = true;  ///< the simulation steps
  int every = 1;      ///< ticks per step
  TickInput input;
  TickReport report;
  int ticks = 0;
  bool known = true;  ///< the device tells its delay

  explicit Bench(ControllerOptions o = vest::haptics::testing::options(), DeviceOptions d = {}) : options(o) {
    device.open(d);
    controller = std::make_unique<Controller>(device.capabilities(), options);
    controller->command(Command::Enable);
  }
  const TickReport& tick() {
    now += kMs;
    ++ticks;
    input.now_ns = now;
    input.status = device.read(input.sample);
    input.timing = known ? device.timing() : Timing{0.001, 0.0};
    if (alive && ticks % every == 0) {
      input.image = tissue.step(
          report.tip_W.isZero() ? Eigen::Vector3d(0, 0, 0.055 + input.sample.position.z()) : report.tip_W,
          now);
    }
    report = controller->tick(input);
    device.enableForces(report.forces_on);
    device.write(report.loads);
    device.advance(0.001);
    return report;
  }
  /// Of a five-axis device above the half space, its trocar straight up.
  const TickReport& shaftTick() {
    input.now_ns = now += kMs;
    input.status = device.read(input.sample);
    input.timing = device.timing();
    input.image = tissue.step({0, 0, 0.165 - input.sample.joints[2]}, now);
    report = controller->tick(input);
    device.enableForces(report.forces_on);
    device.write(report.loads);
    device.advance(0.001);
    return report;
  }
  void run(int n) {
    for (int i = 0; i < n; ++i) tick();
  }
  /// Device frame, m: z = 0 is the surface.
  void hand(double z) { device.wish(2, z); }
  void open() {
    hand(0.01);
    run(300);
    run(2100);
  }
  double force() const {
    return std::sqrt(report.loads[0] * report.loads[0] + report.loads[1] * report.loads[1] +
                     report.loads[2] * report.loads[2]);
  }
  void press() {
    open();
    hand(-0.006);
    run(400);
  }
};

}  // namespace vest::haptics::testing

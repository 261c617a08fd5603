// Protects what a hand feels of whole ticks, on an injected clock: the coupling's bound, clutching, stability
// against something stiff, five axes through the trocar, its friction.
#include <algorithm>

#include <gtest/gtest.h>

#include "bench.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;

TEST(Controller, TheCouplingStaysWithinTheBoundOfColgateAndTheDevicesOwn) {
  Capabilities c = cartesian();
  ControllerOptions o = options();
  o.hand_damping = 0.1;
  EXPECT_NEAR(Controller(c, o).coupling(), 2.0 * (0.005 + 0.1) / 0.001, 1e-9);
  o.hand_damping = 10.0;
  EXPECT_NEAR(Controller(c, o).coupling(), c.stiffness, 1e-9);
}

TEST(Controller, WhenTheInstrumentIsClutchedOrTakenOverElsewhereThereIsNoKick) {
  Bench b;
  b.press();
  // The simulation's instrument is suddenly 20 mm deeper than the hand says.
  b.now += kMs;
  b.input.now_ns = b.now;
  b.input.status = b.device.read(b.input.sample);
  b.input.image = b.tissue.step(b.report.tip_W - Eigen::Vector3d(0, 0, 0.02), b.now);
  b.report = b.controller->tick(b.input);
  EXPECT_EQ(b.force(), 0.0);
}

namespace {

// Peak to peak, m, of a handle that is pressed against something stiff, with models every 4 ms. N·s/m, N/m.
double swing(bool passivity, double hand_damping, double hand_stiffness) {
  ControllerOptions o = options();
  o.passivity = passivity;
  o.hand_damping = 2.0;
  Bench b(o);
  b.tissue.stiffness = 1500.0;
  b.every = 4;
  b.open();
  auto& axis = b.device.axis(2);
  axis.hand_damping = hand_damping;
  axis.hand_stiffness = hand_stiffness;
  b.hand(-0.02);
  double low = 1.0, high = -1.0;
  for (int i = 0; i < 4000; ++i) {
    b.tick();
    if (i > 3000) {
      low = std::min(low, axis.x);
      high = std::max(high, axis.x);
    }
  }
  return high - low;
}

}  // namespace

TEST(Controller, AHeldHandleRestsAgainstSomethingStiff) {
  EXPECT_LT(swing(true, 3.0, 300.0), 0.0001);
}

TEST(Controller, ThePassivityControllerHoldsWhatABareHandleWouldThrowAbout) {
  // Far beyond the bound of Colgate: 0.055 N·s/m against 0.43.
  const double without = swing(false, 0.05, 30.0), with = swing(true, 0.05, 30.0);
  EXPECT_GT(without, 0.05) << "else this shows nothing";
  EXPECT_LT(with, 0.05 * without);
}

TEST(Controller, FiveAxesShowTheTipsForceThroughTheTrocar) {
  ControllerOptions o = options();
  Bench b(o, {{"axes", "joints"}, {"maximum_force", "8"}});
  // Insertion 0.12 m: the tip lies 10 mm below the aim.
  b.device.wish(2, 0.100);
  for (int i = 0; i < 2500; ++i) b.shaftTick();
  b.device.wish(2, 0.116);
  for (int i = 0; i < 500; ++i) b.shaftTick();
  EXPECT_LT(b.report.loads[2], -0.5) << "tissue pushes the instrument out";
  EXPECT_NEAR(b.report.loads[0], 0.0, 1e-3);
  EXPECT_NEAR(b.report.loads[1], 0.0, 1e-3);
  EXPECT_NEAR(b.report.force_shown_W.z(), -b.report.loads[2], 1e-6);
  EXPECT_NEAR(b.report.X_DTip.translation().z(), 0.110 - b.report.sample.joints[2], 1e-9);
}

TEST(Controller, TheTrocarsFrictionOpposesTheShaft) {
  ControllerOptions o = options();
  o.trocar_friction = 0.8;
  Bench b(o);
  b.open();
  b.tissue.level = -1.0;
  b.device.wish(2, 0.01, -0.03);
  b.run(200);
  EXPECT_NEAR(b.report.loads[2], 0.8, 0.15) << "down: it pushes up";
  b.device.wish(2, b.device.axis(2).x, 0.03);
  b.run(200);
  EXPECT_NEAR(b.report.loads[2], -0.8, 0.15);
}

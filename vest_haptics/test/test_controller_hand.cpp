// Protects what a hand feels of whole ticks, on an injected clock: the coupling's bound, clutching, stability
// against something stiff, five axes through the trocar, its friction.
#include <algorithm>
#include <cmath>
#include <deque>

#include <gtest/gtest.h>

#include "bench.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;

namespace {

double stiffnessAt(const Capabilities& c, const ControllerOptions& o, const Timing& timing) {
  Controller controller(c, o);
  TickInput in;
  in.now_ns = 1000 * kMs;
  in.timing = timing;
  return controller.tick(in).stiffness;
}

}  // namespace

TEST(Controller, TheStiffnessStaysWithinTheBoundOfTheTrueDelayAndTheDevicesOwn) {
  Capabilities c = cartesian();
  ControllerOptions o = options();
  o.hand_damping = 0.1;
  const double b = 0.005 + 0.1;
  EXPECT_NEAR(stiffnessAt(c, o, {0.001, 0.0}), b / 0.0005, 1e-9);
  EXPECT_NEAR(stiffnessAt(c, o, {0.001, 0.002}), b / (0.0005 + 0.002), 1e-9);
  EXPECT_NEAR(stiffnessAt(c, o, {0.0004, 0.002}), b / (0.0005 + 0.002), 1e-9)
      << "the loop's own period holds";
  EXPECT_NEAR(stiffnessAt(c, o, {0.003, 0.002}), b / (0.0015 + 0.002), 1e-9) << "a device that is slower";
  c.rate = 500.0;
  EXPECT_NEAR(stiffnessAt(c, o, {}), b / (0.001 + 0.002), 1e-9)
      << "not measured: its rate, and a period on top";
  c.delay = 0.001;
  EXPECT_NEAR(stiffnessAt(c, o, {0.001, 0.002}), b / (0.0005 + 0.003), 1e-9) << "what no host can measure";
  o.hand_damping = 10.0;
  EXPECT_NEAR(stiffnessAt(c, o, {0.001, 0.0}), c.stiffness, 1e-9);
}

namespace {

constexpr double kRigid = 1e6;  // N/m

/// Stiffness that acts at the handle, N/m, of something rigid that is pressed, with forces that grow by gain.
double feltStiffness(double scale, double gain) {
  ControllerOptions o = options();
  o.scale = scale;
  o.force_gain = gain;
  o.passivity = false;
  Bench b(o, {{"maximum_force", "100"}});
  b.tissue.stiffness = kRigid;
  b.device.axis(2).hand_stiffness = 1e5;
  b.device.axis(2).hand_damping = 300.0;
  b.open();
  double f[2] = {}, x[2] = {};
  for (const int i : {0, 1}) {
    b.hand(-0.0005 * (1 + i));
    b.run(600);
    f[i] = b.report.loads[2];
    x[i] = b.device.axis(2).x;
  }
  EXPECT_GT(f[0], 0.3);
  return (f[1] - f[0]) / (x[0] - x[1]);
}

}  // namespace

TEST(Controller, NeitherScaleNorGainMakeTheHandleStifferThanTheBound) {
  for (const double scale : {1.0, 3.0, 0.5}) {
    for (const double gain : {1.0, 4.0, 0.25}) {
      const double lever = scale * scale * gain;  // of the tip's stiffness
      const double expected = 1.0 / (1.0 / 2000.0 + 1.0 / (lever * kRigid));
      EXPECT_NEAR(feltStiffness(scale, gain), expected, 0.01 * expected) << scale << ' ' << gain;
    }
  }
}

TEST(Controller, ADelayThatGrowsSoftensAtOnceAndOneThatShrinksOnlyInTheAir) {
  Bench b;
  b.tissue.stiffness = 5000.0;
  b.press();
  const double before = b.report.stiffness, force = b.force();
  double last = force;
  const auto tickWith = [&](double delay) {
    b.now += kMs;
    b.input.timing = {0.001, delay};
    b.input.now_ns = b.now;
    b.input.status = b.device.read(b.input.sample);
    b.input.image = b.tissue.step(b.report.tip_W, b.now);
    b.report = b.controller->tick(b.input);
    b.device.write(b.report.loads);
    b.device.advance(0.001);
  };
  for (int i = 0; i < 50; ++i) {
    tickWith(0.004);
    EXPECT_LE(std::abs(b.force() - last), 0.05 * 3.3 + 1e-9) << "without a jump";
    last = b.force();
  }
  EXPECT_NEAR(b.report.stiffness, 1.005 / 0.0045, 1.0);
  EXPECT_LT(b.force(), 0.9 * force);
  for (int i = 0; i < 50; ++i) tickWith(0.0);
  EXPECT_NEAR(b.report.stiffness, 1.005 / 0.0045, 1.0) << "still in the tissue";
  b.hand(0.01);
  for (int i = 0; i < 400; ++i) tickWith(0.0);
  EXPECT_NEAR(b.report.stiffness, before, 1.0);
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

/// A session as it is: its instrument follows the device's own pose, 20 ms later and off by what clutching
/// left.
struct Followed : Bench {
  double clutch = 0.0;     ///< m
  std::deque<double> own;  ///< m, world: the newest last
  double off() const { return report.tip_W.z() - own.back() - clutch; }
  void follow(int n) {
    for (int i = 0; i < n; ++i) {
      input.now_ns = now += kMs;
      input.status = device.read(input.sample);
      own.push_back(0.055 + input.sample.position.z());
      if (own.size() > 21) own.pop_front();
      input.image = tissue.step({0, 0, own.front() + clutch}, now);
      report = controller->tick(input);
      device.enableForces(report.forces_on);
      device.write(report.loads);
      device.advance(0.001);
    }
  }
};

}  // namespace

TEST(Controller, AClutchThatAMovingHandLetsGoLeavesNoOffset) {
  Followed b;
  b.hand(0.04);
  b.follow(500);
  b.device.wish(2, 0.04, -0.1);
  b.follow(200);
  b.clutch = -0.01;
  b.follow(50);
  EXPECT_GT(std::abs(b.off()), 0.001) << "of a moving hand it is not known how old the pose was";
  b.hand(0.01);
  b.follow(1000);
  EXPECT_LT(std::abs(b.off()), 1e-4);
}

TEST(Controller, AShortClutchInTissueIsFollowedWithoutAKick) {
  Followed b;
  b.hand(0.01);
  b.follow(2400);
  b.hand(-0.004);
  b.follow(500);
  const double force = b.report.loads[2];
  ASSERT_GT(force, 0.3);
  b.clutch = -0.002;  // less than what counts as a change
  double last = b.report.tip_W.z() - b.own.back();
  for (int i = 0; i < 1000; ++i) {
    b.follow(1);
    const double offset = b.report.tip_W.z() - b.own.back();
    EXPECT_LE(std::abs(offset - last), 1.01e-3 * Registration::kFollow);
    last = offset;
  }
  EXPECT_NEAR(last, -0.002, 1e-5);
  EXPECT_EQ(b.report.allowance, 1.0);
  EXPECT_GT(b.report.loads[2], force + 0.2) << "as deep as the instrument is";
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

namespace {

// Peak to peak, m, of a handle with twice the damping that is assumed, pressed against something rigid
// through a device that shows each force 3 ms late, with passivity off. `told`: whether the device's delay is
// known.
double swingWithDelay(bool told) {
  ControllerOptions o = options();
  o.passivity = false;
  Bench b(o, {{"delay", "0.003"}, {"maximum_force", "20"}});
  b.tissue.stiffness = 1e5;
  b.known = told;
  b.open();
  auto& axis = b.device.axis(2);
  axis.hand_damping = 2.0 * o.hand_damping;
  axis.hand_stiffness = 100.0;
  b.hand(-0.01);
  double low = 1.0, high = -1.0;
  for (int i = 0; i < 5000; ++i) {
    b.tick();
    EXPECT_EQ(b.report.fault, Fault::None);
    if (i > 4000) {
      low = std::min(low, axis.x);
      high = std::max(high, axis.x);
    }
  }
  return high - low;
}

}  // namespace

TEST(Controller, WithTheTrueDelayInTheBoundAHandleRestsThatSwingsWithoutIt) {
  EXPECT_GT(swingWithDelay(false), 0.001) << "else this shows nothing";
  EXPECT_LT(swingWithDelay(true), 0.0001);
}

namespace {

// Peak to peak of the force that the hand itself gives, N, and its mean, at each depth of a slow press and
// release.
struct Feel {
  double in = 0.0, out = 0.0, shown = 0.0;  ///< N at the same depth, going in and coming out
};
Feel feelAt(double friction, double gain, double depth) {
  ControllerOptions o = options();
  o.force_gain = gain;
  Bench b(o, {{"friction", std::to_string(friction)}, {"maximum_force", "8"}});
  b.tissue.stiffness = 300.0;
  auto& axis = b.device.axis(2);
  axis.hand_stiffness = 5000.0;
  axis.hand_damping = 20.0;
  b.open();
  Feel out;
  const auto hand = [&](double h) { return axis.hand_stiffness * (axis.x - h); };
  // 5 mm/s, so that the dampers take 0.1 N.
  double h = 0.002;
  for (; axis.x > -depth; h -= 5e-6) b.hand(h), b.tick();
  out.in = hand(h), out.shown = b.force();
  for (double more = h - 0.002; h > more; h -= 5e-6) b.hand(h), b.tick();
  for (; axis.x < -depth; h += 5e-6) b.hand(h), b.tick();
  out.out = hand(h);
  return out;
}

}  // namespace

TEST(Controller, TheHandFeelsTheForceShownBetweenTheDevicesFrictions) {
  // 0.26 N: what the maker of the Touch names as its backdrive friction.
  for (const double gain : {1.0, 3.0}) {
    const Feel f = feelAt(0.26, gain, 0.004);
    const double series = 1.0 / (1.0 / 300.0 + gain / 2000.0);  // tissue and coupling
    EXPECT_NEAR(f.shown, gain * series * 0.004, 0.02 * f.shown) << gain;
    EXPECT_NEAR(0.5 * (f.in + f.out), f.shown, 0.1) << gain << ": the middle of the loop is what is shown";
    EXPECT_NEAR(0.5 * (f.in - f.out), 0.26, 0.13)
        << gain << ": its half width is the friction, and the dampers";
  }
  // The softest touch goes under in the friction, and gain brings it up: a handle that nobody holds does not
  // move.
  for (const bool lifted : {false, true}) {
    ControllerOptions o = options();
    o.force_gain = lifted ? 4.0 : 1.0;
    Bench b(o, {{"friction", "0.26"}});
    b.tissue.stiffness = 50.0;
    b.open();
    b.hand(-0.003);
    b.run(400);
    auto& axis = b.device.axis(2);
    axis.hand_stiffness = axis.hand_damping = 0.0;
    const double from = axis.x;
    b.run(200);
    EXPECT_EQ(axis.x - from > 1e-4, lifted);
  }
}

TEST(Controller, ForcesBeyondWhatTheMotorsBearForEverLastForSecondsOnly) {
  Bench b(options(), {{"continuous", "0.88"}});  // N, of 3.3 N
  b.tissue.stiffness = 1000.0;
  b.open();
  b.hand(-0.0005);
  b.run(300);
  EXPECT_GT(b.force(), 0.1);
  EXPECT_LT(b.force(), 1.1 * b.report.force_true_W.z()) << "a touch stays a touch";
  b.hand(-0.015);
  b.run(300);
  EXPECT_GT(b.force(), 2.5) << "a push has all of it";
  double last = b.force(), square = 0.0;
  for (int i = 0; i < 60000; ++i) {
    b.tick();
    ASSERT_LE(std::abs(b.force() - last), 0.05 * 3.3 + 1e-9) << "and no jump";
    last = b.force();
    if (i >= 30000) square += last * last / 30000.0;
  }
  EXPECT_NEAR(std::sqrt(square), 0.88, 0.03) << "what is left is what they bear";
  b.hand(0.01);
  b.run(20000);
  b.hand(-0.015);
  b.run(300);
  EXPECT_GT(b.force(), 2.5) << "cooled down";
}

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
  EXPECT_NEAR(b.report.X_BTip.translation().z(), 0.165 - b.report.sample.joints[2], 1e-9);
}

TEST(Controller, TheMeasuredPoseAndSpeedAreThoseOfTheTipInTheBoxWhateverScaleAndTilt) {
  ControllerOptions o = options();
  o.scale = 2.0;
  o.X_WB = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX());
  Bench b(o);
  b.alive = false;
  b.device.wish(0, 0.01);
  b.device.wish(2, 0.02);
  b.run(500);
  const Eigen::Vector3d p = b.report.sample.position;
  EXPECT_NEAR((b.report.X_BTip.translation() - (o.arm.aim_B + 2.0 * p)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((o.X_WB * b.report.X_BTip.translation() - b.report.tip_W).norm(), 0.0, 1e-12);
  b.device.wish(0, b.device.axis(0).x, 0.02);
  b.run(300);
  EXPECT_NEAR(b.report.velocity_B.x(), 0.04, 0.002) << "the hand's 20 mm/s, scaled";
  EXPECT_NEAR(b.report.velocity_B.z(), 0.0, 0.002);
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

// Protects the whole of a tick, on an injected clock: states, faults, dying simulations, start inside tissue,
// allocation.
#include <dlfcn.h>
#include <pthread.h>

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "allocations.h"
#include "bench.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;
using vest::control::OperatingState;

namespace {

int locks = 0;
bool watch_locks = false;

}  // namespace

extern "C" int pthread_mutex_lock(pthread_mutex_t* m) {
  static auto* real = reinterpret_cast<int (*)(pthread_mutex_t*)>(::dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (watch_locks) ++locks;
  return real(m);
}

TEST(Controller, AHandThatPressesFeelsTheTissue) {
  Bench b;
  b.press();
  const double depth = -b.input.sample.position.z();
  EXPECT_GT(b.force(), 0.5);
  EXPECT_NEAR(b.report.loads[2], b.report.force_true_W.z(), 0.2 * b.report.force_true_W.z());
  EXPECT_NEAR(b.report.force_true_W.z(), 300.0 * depth, 0.02);
  EXPECT_EQ(b.report.state, OperatingState::Enabled);
  b.hand(0.01);
  b.run(400);
  EXPECT_EQ(b.force(), 0.0) << "nothing sticks on retreat";
}

TEST(Controller, ADeviceThatWakesUpTwentyMillimetresDeepStaysLimp) {
  Bench b;
  b.device.axis(2).x = -0.020;
  b.hand(-0.020);
  for (int i = 0; i < 5000; ++i) {
    b.tick();
    ASSERT_EQ(b.force(), 0.0) << "tick " << i;
  }
  b.hand(0.01);
  b.run(400);
  b.hand(-0.006);
  double last = 0.0;
  for (int i = 0; i < 1500; ++i) {
    b.tick();
    ASSERT_LE(b.report.allowance, 1.0 - 1e-6) << "two seconds of ramp";
    ASSERT_TRUE(b.report.limits & kLimitRamp) << "and it says so";
    ASSERT_LE(std::abs(b.force() - last), 0.05 * 3.3 + 1e-9);
    last = b.force();
  }
  b.run(1000);
  EXPECT_GT(b.force(), 0.5);
}

// A simulation that began before the device was there has its instrument elsewhere, and fetches it through
// the air. What is felt there says nothing of where the hand is.
TEST(Controller, WhileTheInstrumentIsStillOnItsWayToADeviceThatWakesUpDeepThereIsNoForce) {
  for (const double speed : {2.0, 0.2}) {  // m/s: kProxySpeedLimit, and of a slower simulation
    Bench b;
    b.device.axis(2).x = -0.020;
    b.hand(-0.020);
    Eigen::Vector3d proxy(0, 0, 0.115);
    for (int i = 0; i < 5000; ++i) {
      b.input.now_ns = b.now += kMs;
      b.input.status = b.device.read(b.input.sample);
      b.input.timing = b.device.timing();
      const Eigen::Vector3d hand(0, 0, 0.055 + b.input.sample.position.z());
      const Eigen::Vector3d commanded = i < 100 ? Eigen::Vector3d(0, 0, 0.115) : hand;
      const Eigen::Vector3d way = commanded - proxy;
      proxy += way * std::min(1.0, 0.001 * speed / std::max(1e-9, way.norm()));
      b.input.image = b.tissue.step(proxy, b.now);
      for (int e = 0; e < 3; ++e) b.tissue.image.contacts[0].commanded[e] = commanded[e];
      b.report = b.controller->tick(b.input);
      ASSERT_EQ(b.report.loads, Loads{}) << "tick " << i << ", " << speed << " m/s";
      b.device.advance(0.001);
    }
    EXPECT_GT(b.report.force_true_W.z(), 1.0) << "it is deep";
  }
}

TEST(Controller, AnInstrumentThatSomethingHoldsBackIsStillFelt) {
  Bench b;
  b.press();
  const double before = b.force();
  b.tissue.lag = 0.004;
  b.run(200);
  EXPECT_EQ(b.report.allowance, 1.0);
  EXPECT_GT(b.force(), 0.5 * before);
}

TEST(Controller, AToolThatAppearsInTissueOrASceneThatBeginsAnewIsNotFeltUntilTheHandIsOut) {
  for (const bool scene : {false, true}) {
    Bench b;
    b.tissue.present = scene;
    b.open();
    if (scene) b.tissue.level = 0.0;
    b.hand(-0.010);
    b.run(400);
    ASSERT_EQ(b.report.allowance, 1.0) << "nothing was touched";
    b.tissue.present = true;
    b.tissue.level = 0.055;
    if (scene) {
      ++b.tissue.image.generation;
      b.tissue.image.step = 0;
    }
    for (int i = 0; i < 3000; ++i) {
      b.tick();
      ASSERT_EQ(b.force(), 0.0) << "tick " << i;
    }
    EXPECT_GT(b.report.force_true_W.z(), 1.0) << "it is deep";
    b.press();
    EXPECT_GT(b.force(), 0.5);
  }
}

TEST(Controller, AFiveAxisDeviceThatWakesUpInTissueStaysLimp) {
  Bench b(options(), {{"axes", "joints"}, {"maximum_force", "8"}});
  b.device.wish(2, 0.130);
  b.device.axis(2).x = 0.130;
  for (int i = 0; i < 1000; ++i) {
    b.shaftTick();
    ASSERT_EQ(b.report.loads, Loads{}) << "tick " << i;
  }
}

TEST(Controller, ASimulationThatDiesIsZeroFiftyMillisecondsAfterItsLastStep) {
  const auto phases = counted(1000, 100, "deaths at random phases, injected clock");
  std::mt19937 random(3);
  Bench b;
  b.open();
  for (int n = 0; n < phases; ++n) {
    b.alive = true;
    b.hand(0.01);
    for (int i = 0; i < 400 || b.report.allowance < 1.0; ++i) b.tick();
    b.hand(-0.006);
    b.every = 1 + static_cast<int>(random() % 4);
    b.run(200 + static_cast<int>(random() % 50));
    ASSERT_GT(b.force(), 0.5);
    const std::int64_t died = b.tissue.image.steady_ns;
    b.alive = false;
    // A hung solver beside a thread that still sends its heart-beat: stamps go on, steps do not.
    const bool heartbeat = random() % 2;
    double before = b.force();
    for (int i = 0; i < 100; ++i) {
      if (heartbeat) b.tissue.image.steady_ns = b.now;
      b.tick();
      const double age = 1e-9 * static_cast<double>(b.now - died);
      if (age >= 0.050) {
        ASSERT_EQ(b.force(), 0.0) << "phase " << n << " age " << age;
        ASSERT_TRUE(b.report.limits & kLimitStale) << "it says why";
      } else if (age > 0.021) {
        ASSERT_LE(b.force(), before + 0.02) << "phase " << n;
      }
      ASSERT_LE(std::abs(b.force() - before), 0.05 * 3.3 + 1e-9) << "phase " << n << " age " << age;
      before = b.force();
    }
  }
}

TEST(Controller, StepsThatArriveFiveSecondsLateMoveNothing) {
  Bench b;
  b.press();
  b.alive = false;
  b.run(200);
  const std::int64_t late = 5000 * kMs;
  HalfSpace queue = b.tissue;
  b.now += late - 200 * kMs;
  b.input.image = &queue.image;
  for (int i = 0; i < 200; ++i) {
    ++queue.image.step;
    queue.image.steady_ns += kMs;
    b.tick();
    ASSERT_EQ(b.force(), 0.0);
  }
}

TEST(Controller, WhatADeadSimulationLeftInTheMemoryIsNeitherForceNorFault) {
  Bench b;
  b.alive = false;
  HalfSpace left;
  left.jump = std::numeric_limits<double>::quiet_NaN();
  left.step({0, 0, 0.035}, b.now - 60000 * kMs);
  b.input.image = &left.image;
  for (int i = 0; i < 200; ++i) {
    b.tick();
    ASSERT_EQ(b.force(), 0.0);
  }
  EXPECT_EQ(b.report.state, OperatingState::Enabled) << "a process that was started anew must be of use";
  EXPECT_TRUE(b.report.limits & kLimitStale);
}

TEST(Controller, AnImageOfAnEarlierSimulationIsNotLookedAtBesideOneThatIsAlive) {
  Bench b;
  b.run(10);
  b.alive = false;
  HalfSpace earlier;
  earlier.jump = std::numeric_limits<double>::quiet_NaN();
  earlier.step({0, 0, 0.035}, b.now);
  earlier.image.generation = 0;
  b.input.image = &earlier.image;
  b.run(10);
  EXPECT_EQ(b.report.state, OperatingState::Enabled);
}

TEST(Controller, AfterASimulationCameBackTheHandMustComeOutFirst) {
  Bench b;
  b.press();
  b.alive = false;
  b.run(100);
  ASSERT_EQ(b.force(), 0.0);
  b.alive = true;
  b.run(3000);
  EXPECT_EQ(b.force(), 0.0) << "still inside the tissue";
}

TEST(Controller, AnErrorOfTheDeviceIsZeroAndLatchedUntilDisableAndEnable) {
  Bench b;
  b.press();
  ASSERT_GT(b.force(), 0.5);
  b.device.inject(DeviceStatus::Error);
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
  EXPECT_FALSE(b.report.forces_on);
  EXPECT_EQ(b.report.state, OperatingState::Fault);
  EXPECT_EQ(b.report.fault, Fault::DeviceError);
  EXPECT_TRUE(b.report.limits & kLimitFault);
  b.device.inject(DeviceStatus::Ok);
  b.run(100);
  EXPECT_EQ(b.report.state, OperatingState::Fault) << "it does not go away by itself";
  EXPECT_FALSE(b.controller->command(Command::Enable)) << "nor by enable alone";
  EXPECT_FALSE(b.controller->command(Command::Pause));
  EXPECT_FALSE(b.controller->command(Command::Resume));
  EXPECT_TRUE(b.controller->command(Command::Disable));
  EXPECT_TRUE(b.controller->command(Command::Enable));
  b.run(1000);
  EXPECT_EQ(b.report.state, OperatingState::Enabled);
  EXPECT_EQ(b.force(), 0.0) << "the hand is still inside";
}

TEST(Controller, SpoiledReadingsAreHeldTenMillisecondsAndThenAFault) {
  for (const double v : {std::nan(""), std::numeric_limits<double>::infinity(), 3.0}) {
    for (int field = 0; field < 3; ++field) {
      Bench b;
      b.press();
      b.device.spoil(field, v);
      b.run(9);
      EXPECT_EQ(b.report.state, OperatingState::Enabled) << field;
      EXPECT_TRUE(std::isfinite(b.force()));
      b.run(5);
      EXPECT_EQ(b.report.fault, Fault::Sensor) << field;
      EXPECT_FALSE(b.report.valid);
      EXPECT_EQ(b.force(), 0.0);
    }
  }
}

TEST(Controller, AnExplodingSimulationIsAFaultWithinATick) {
  for (const double v : {std::nan(""), std::numeric_limits<double>::infinity(), 1e9}) {
    Bench b;
    b.press();
    b.tissue.jump = v;
    b.tick();
    EXPECT_EQ(b.force(), 0.0);
    EXPECT_EQ(b.report.fault, Fault::ContactModel);
  }
}

TEST(Controller, StiffnessFromNothingToTheAbsurdNeverBreaksTheLimits) {
  for (int power = -3; power <= 12; ++power) {
    Bench b;
    b.tissue.stiffness = std::pow(10.0, power);
    b.open();
    b.hand(-0.006);
    double last = b.force();
    for (int i = 0; i < 600; ++i) {
      b.tick();
      ASSERT_TRUE(std::isfinite(b.force()));
      ASSERT_LE(b.force(), 3.3);
      if (b.report.state != OperatingState::Fault) {
        ASSERT_LE(std::abs(b.force() - last), 0.05 * 3.3 + 1e-9) << "stiffness 1e" << power;
      }
      last = b.force();
    }
  }
}

TEST(Controller, AnUnpluggedDeviceComesBackByItselfButNotWithForce) {
  Bench b;
  b.press();
  b.device.inject(DeviceStatus::Unplugged);
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
  EXPECT_FALSE(b.report.valid);
  b.run(50);
  b.device.inject(DeviceStatus::Ok);
  b.run(1000);
  EXPECT_TRUE(b.report.valid);
  EXPECT_EQ(b.report.state, OperatingState::Enabled);
  EXPECT_EQ(b.force(), 0.0) << "the hand is still inside";
}

TEST(Controller, DisabledAndPausedShowNothing) {
  Bench b;
  b.press();
  ASSERT_TRUE(b.controller->command(Command::Pause));
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
  EXPECT_FALSE(b.report.forces_on);
  ASSERT_TRUE(b.controller->command(Command::Resume));
  b.run(10);
  EXPECT_EQ(b.force(), 0.0) << "resume does not kick a hand that is inside";
  ASSERT_TRUE(b.controller->command(Command::Disable));
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
}

TEST(Controller, AConfiguredLimitLowersAndNeverRaises) {
  for (const double limit : {0.5, 100.0}) {
    ControllerOptions o = options();
    o.force_limit = limit;
    Bench b(o);
    b.tissue.stiffness = 5000.0;
    b.open();
    b.hand(-0.03);
    double most = 0.0;
    for (int i = 0; i < 800; ++i) {
      b.tick();
      most = std::max(most, b.force());
    }
    EXPECT_NEAR(most, std::min(limit, 3.3), 0.1) << limit;
    EXPECT_LE(most, std::min(limit, 3.3));
  }
}

TEST(Controller, ServoForcesGoThroughTheSameGuardsAndDecayWhenTheyStop) {
  Bench b;
  b.alive = false;
  b.input.image = nullptr;
  b.hand(0.0);
  for (int i = 0; i < 2600; ++i) {
    b.input.servo_force = {i > 60 ? 50.0 : 0.0, 0, 0};
    b.input.servo_ns = b.now;
    if (i == 60) b.input.servo_force.setZero();
    b.tick();
    ASSERT_LE(b.force(), 3.3);
  }
  EXPECT_GT(b.force(), 3.0);
  // The last stamp is one tick old here. The whole force for 20 ms from it, none from 50 ms on.
  for (int age = 1; age < 60; ++age) {
    b.tick();
    if (age < 20) {
      EXPECT_GT(b.force(), 3.0) << age << " ms";
    } else if (age >= 50) {
      EXPECT_EQ(b.force(), 0.0) << age << " ms";
    }
  }
}

TEST(Controller, ASimulationThatDiesBeyondTheMaximumIsZeroInTimeToo) {
  Bench b;
  b.tissue.stiffness = 4000.0;
  b.open();
  b.hand(-0.03);
  b.run(500);
  ASSERT_GT(b.force(), 3.2);
  b.alive = false;
  double before = b.force();
  for (int i = 1; i <= 60; ++i) {
    b.tick();
    ASSERT_LE(std::abs(b.force() - before), 0.05 * 3.3 + 1e-9) << i << " ms: it fades, it is not cut off";
    before = b.force();
  }
  EXPECT_EQ(b.force(), 0.0);
}

TEST(Controller, AfterOldDataTheFirstNewModelIsNotBlendedWithTheOldOne) {
  Bench b;
  b.press();
  b.alive = false;
  b.run(100);
  b.tissue.stiffness = 0.0;
  b.alive = true;
  b.tick();
  EXPECT_EQ(b.controller->report().loads, Loads{});
  EXPECT_LT(std::abs(b.report.force_true_W.z()), 1e-9);
  // Twenty small forces open the gate: the old force must not be among them.
  b.run(22);
  EXPECT_FALSE(b.report.limits & kLimitStale);
  EXPECT_GT(b.report.allowance, 0.0) << "nothing of the old force holds the gate";
}

// A client's forces keep the gate open while a simulation stands still. The hand may be deep in tissue when
// it goes on.
TEST(Controller, BesideServoForcesASimulationThatGoesOnIsNotFeltUntilTheHandIsOut) {
  Bench b;
  const auto run = [&](int ticks, const auto& each) {
    for (int i = 0; i < ticks; ++i) {
      b.input.servo_force = {0.1, 0, 0};
      b.input.servo_ns = b.now;
      b.tick();
      each();
    }
  };
  b.open();
  run(100, [&] { ASSERT_GT(b.force(), 0.0); });
  b.alive = false;
  b.hand(-0.02);
  run(60, [] {});
  run(500, [&] { ASSERT_NEAR(b.force(), 0.1, 0.01) << "the client's alone"; });
  b.alive = true;
  run(1000, [&] { ASSERT_LE(b.force(), 0.1); });
  b.hand(0.01);
  run(3000, [] {});
  b.hand(-0.006);
  run(500, [] {});
  EXPECT_GT(b.force(), 0.5) << "it is felt again";
}

TEST(Controller, AServoForceThatIsNoNumberIsAFault) {
  Bench b;
  b.open();
  b.input.servo_force = {std::nan(""), 0, 0};
  b.input.servo_ns = b.now + kMs;
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
  EXPECT_EQ(b.report.fault, Fault::NotFinite);
  b.run(100);
  ASSERT_TRUE(b.controller->command(Command::Disable));
  ASSERT_TRUE(b.controller->command(Command::Enable));
  b.run(10);
  EXPECT_EQ(b.report.state, OperatingState::Enabled)
      << "an old force is forgotten, even one that is no number";
}

TEST(Controller, AServoForceIsNoTorqueOfAFiveAxisDevice) {
  Bench b(options(), {{"axes", "joints"}});
  b.tissue.level = -1.0;
  for (int i = 0; i < 3000; ++i) {
    b.input.servo_force = {0, 0, i > 2500 ? 1.0 : 0.0};
    b.input.servo_ns = b.now;
    b.shaftTick();
    ASSERT_EQ(b.report.loads, Loads{});
  }
  EXPECT_EQ(b.report.allowance, 1.0) << "it would be shown";
}

TEST(Controller, TwoTicksAtTheSameMomentAreNoFault) {
  Bench b;
  b.press();
  b.now -= kMs;
  b.tick();
  EXPECT_EQ(b.report.state, OperatingState::Enabled);
  EXPECT_TRUE(std::isfinite(b.force()));
}

TEST(Controller, AfterAStartOrAPauseThereIsNoSpeed) {
  Bench b;
  b.hand(0.03);
  b.device.axis(2).x = 0.03;
  b.tick();
  EXPECT_EQ(b.report.velocity_B.norm(), 0.0) << "the first place is no motion";
  b.run(100);
  b.device.axis(2).x = 0.02;
  b.hand(0.02);
  b.now += 200 * kMs;
  b.tick();
  EXPECT_EQ(b.report.velocity_B.norm(), 0.0) << "what happened in the pause is unknown";
  b.device.inject(DeviceStatus::Unplugged);
  b.run(3);
  b.device.axis(2).x = 0.03;
  b.device.inject(DeviceStatus::Ok);
  b.tick();
  EXPECT_EQ(b.report.velocity_B.norm(), 0.0) << "and what it did while it was unplugged";
}

TEST(Controller, ASlewThatIsConfiguredTooFastIsNotTaken) {
  ControllerOptions o = options();
  o.slew_seconds = 0.001;
  Bench b(o);
  b.tissue.stiffness = 1e5;
  b.open();
  b.hand(-0.02);
  double last = 0.0;
  for (int i = 0; i < 300; ++i, last = b.force()) {
    b.tick();
    ASSERT_LE(std::abs(b.force() - last), 0.05 * 3.3 + 1e-9);
  }
  EXPECT_GT(last, 1.0);
}

TEST(Controller, ASteadyClockThatGoesBackIsAFault) {
  Bench b;
  b.press();
  b.now -= 100 * kMs;
  b.tick();
  EXPECT_EQ(b.report.fault, Fault::Clock);
  EXPECT_EQ(b.force(), 0.0);
}

TEST(Controller, ALoopThatStoodStillBeginsWithoutForce) {
  Bench b;
  b.press();
  b.now += 200 * kMs;  // the process was stopped; the simulation was not
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
  b.run(500);
  EXPECT_EQ(b.force(), 0.0) << "the hand is still inside";
}

TEST(Controller, ASecondPublisherOnASafetyTopicIsAFault) {
  Bench b;
  b.press();
  b.controller->raise(Fault::Publisher);
  b.tick();
  EXPECT_EQ(b.force(), 0.0);
  EXPECT_EQ(b.report.fault, Fault::Publisher);
  b.controller->raise(Fault::Sensor);
  EXPECT_EQ(b.controller->report().fault, Fault::Publisher) << "the first fault is the cause";
}

TEST(Controller, ATickAllocatesNothingAndTakesNoLock) {
  Bench b;
  b.press();
  allocations = 0;
  std::uint64_t total = 0;
  int taken = 0;
  for (int i = 0; i < 2000; ++i) {
    b.input.now_ns = b.now += kMs;
    b.input.status = b.device.read(b.input.sample);
    b.input.image = b.tissue.step(b.report.tip_W, b.now);
    allocations = 0;
    locks = 0;
    watch_locks = true;
    const TickReport& r = b.controller->tick(b.input);
    watch_locks = false;
    total += allocations;
    taken += locks;
    b.device.write(r.loads);
    b.device.advance(0.001);
    b.report = r;
  }
  EXPECT_EQ(total, 0u);
  EXPECT_EQ(taken, 0);
  void* p = std::malloc(1);
  EXPECT_GT(allocations, 0u) << "the trap works";
  std::free(p);
  pthread_mutex_t m = PTHREAD_MUTEX_INITIALIZER;
  watch_locks = true;
  pthread_mutex_lock(&m);
  watch_locks = false;
  pthread_mutex_unlock(&m);
  EXPECT_GT(locks, 0) << "the trap works";
}

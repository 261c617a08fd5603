// Protects the hand: freshness, start-up gate, readings, and the energy of sampled contact.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "support.h"
#include "vest_haptics/device/simulated.h"
#include "vest_haptics/loop/registration.h"

using namespace vest::haptics;
using namespace vest::haptics::testing;

TEST(Freshness, ForceDecaysFromTwentyMillisecondsAndIsZeroByFifty) {
  EXPECT_EQ(allowanceForAge(0.0), 1.0);
  EXPECT_EQ(allowanceForAge(0.020), 1.0);
  EXPECT_LT(allowanceForAge(0.0201), 1.0);
  EXPECT_NEAR(allowanceForAge(0.035), 0.5, 1e-12);
  EXPECT_GT(allowanceForAge(0.0499), 0.0);
  EXPECT_EQ(allowanceForAge(0.050), 0.0);
  EXPECT_EQ(allowanceForAge(1e9), 0.0);
  EXPECT_EQ(allowanceForAge(std::nan("")), 0.0);
  EXPECT_EQ(allowanceForAge(std::numeric_limits<double>::infinity()), 0.0);
}

TEST(Freshness, AStepThatStandsStillIsDeadHoweverYoungItsStampIs) {
  Freshness f;
  ASSERT_TRUE(f.accept(1, 10, 0, 0));
  for (int ms = 1; ms < 100; ++ms) EXPECT_FALSE(f.accept(1, 10, ms * kMs, ms * kMs));
  EXPECT_EQ(allowanceForAge(f.age(99 * kMs)), 0.0);
}

TEST(Freshness, OldStepsThatArriveLateStayOld) {
  Freshness f;
  ASSERT_TRUE(f.accept(1, 1, 0, 0));
  // Five seconds of stopped simulation, then its queue: newer steps with stamps from back then.
  const std::int64_t now = 5000 * kMs;
  for (std::uint64_t step = 2; step < 100; ++step) {
    f.accept(1, step, static_cast<std::int64_t>(step) * kMs, now);
    EXPECT_EQ(allowanceForAge(f.age(now)), 0.0);
  }
  EXPECT_TRUE(f.accept(1, 100, now, now));
  EXPECT_EQ(allowanceForAge(f.age(now)), 1.0);
}

TEST(Freshness, AStampFromTheFutureAnOlderGenerationAndAnEarlierStampAreRefused) {
  Freshness f;
  EXPECT_FALSE(f.accept(1, 1, 2 * kMs, 0));
  EXPECT_EQ(f.age(0), std::numeric_limits<double>::infinity());
  ASSERT_TRUE(f.accept(2, 50, 10 * kMs, 10 * kMs));
  EXPECT_FALSE(f.accept(1, 60, 11 * kMs, 11 * kMs)) << "a simulation that was replaced";
  EXPECT_FALSE(f.accept(2, 51, 9 * kMs, 11 * kMs)) << "a stamp that goes back";
  EXPECT_FALSE(f.accept(2, 49, 11 * kMs, 11 * kMs)) << "a step that goes back";
  EXPECT_TRUE(f.accept(3, 1, 11 * kMs, 11 * kMs)) << "after a reset steps begin anew";
}

TEST(Gate, OpensOnlyAfterTwentySmallForcesAndThenRampsForTwoSeconds) {
  Gate gate;
  for (int i = 0; i < 5000; ++i) ASSERT_EQ(gate.update(true, 0.5, 0.001), 0.0) << "deep inside tissue";
  for (int i = 0; i < 19; ++i) ASSERT_EQ(gate.update(true, 0.01, 0.001), 0.0);
  ASSERT_EQ(gate.update(true, 0.2, 0.001), 0.0);
  for (int i = 0; i < 20; ++i) ASSERT_EQ(gate.update(true, 0.01, 0.001), 0.0) << "the count begins anew";
  double last = 0.0;
  int ticks = 0;
  while (last < 1.0) {
    const double a = gate.update(true, 0.9, 0.001);
    ASSERT_GT(a, last);
    ASSERT_LE(a - last, 0.00051);
    last = a;
    ++ticks;
  }
  EXPECT_NEAR(ticks, 2000, 2);
  EXPECT_TRUE(gate.open());
}

TEST(Gate, AnyFaultClosesItAtOnceAndTheWholeWayBeginsAnew) {
  Gate gate;
  for (int i = 0; i < 3000; ++i) gate.update(true, 0.0, 0.001);
  ASSERT_EQ(gate.update(true, 0.0, 0.001), 1.0);
  EXPECT_EQ(gate.update(false, 0.0, 0.001), 0.0);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(gate.update(true, 0.0, 0.001), 0.0);
  EXPECT_LT(gate.update(true, 0.0, 0.001), 0.01);
  Gate odd;
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(odd.update(true, std::nan(""), 0.001), 0.0) << "no number is not small";
}

namespace {

Sample at(double x) {
  Sample s;
  s.position.x() = x;
  return s;
}

Capabilities all() {
  Capabilities c = cartesian();
  c.orientation = c.jaw = true;
  return c;
}

// Fields of a reading: 0 … 2 place, 3 … 6 attitude, 7 jaw; of a device with joints, 7 … 11 these.
void spoil(Sample& s, bool joints, int field, double value) {
  if (field < 3)
    s.position[field] = value;
  else if (field < 7)
    s.orientation.coeffs()[field - 3] = value;
  else if (joints)
    s.joints[static_cast<std::size_t>(field - 7)] = value;
  else
    s.jaw = value;
}

}  // namespace

TEST(SensorCheck, EveryFieldIsGuardedAgainstNoNumberAndAgainstJumps) {
  const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity(), 5.0};
  for (const bool joints : {false, true}) {
    Capabilities c = all();
    c.joints = joints;
    for (int field = joints ? 7 : 0; field < (joints ? 12 : 8); ++field) {
      for (const double value : bad) {
        SensorCheck check(c);
        Sample good = at(0.01);
        ASSERT_EQ(check.check(good, 0), SensorCheck::Verdict::Good);
        for (int ms = 1; ms <= 30; ++ms) {
          Sample s = at(0.01);
          spoil(s, joints, field, value);
          const auto verdict = check.check(s, ms * kMs);
          ASSERT_EQ(verdict, ms <= 11 ? SensorCheck::Verdict::Held : SensorCheck::Verdict::Fault)
              << "field " << field << " value " << value << " at " << ms << " ms";
          ASSERT_EQ(s.position.x(), 0.01) << "the last good reading stands in";
          ASSERT_EQ(s.jaw, 0.0);
        }
      }
    }
  }
}

TEST(SensorCheck, AnAttitudeThatTurnsHalfRoundInATickIsNotBelieved) {
  SensorCheck check(all());
  Sample s = at(0.0);
  ASSERT_EQ(check.check(s, 0), SensorCheck::Verdict::Good);
  s.orientation = Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX());
  EXPECT_EQ(check.check(s, kMs), SensorCheck::Verdict::Held);
  EXPECT_NEAR(s.orientation.w(), 1.0, 1e-12);
}

TEST(SensorCheck, TheFirstReadingIsBelievedWhereverTheHandIsAndAnAttitudeAfterAPauseToo) {
  for (const bool joints : {false, true}) {
    Capabilities c = all();
    c.joints = joints;
    SensorCheck check(c);
    Sample s = at(0.3);
    s.orientation = Eigen::AngleAxisd(1.5, Eigen::Vector3d::UnitX());
    s.jaw = 0.6;
    s.joints = {0.5, 0.5, 0.2, 0.5, 0.5};
    EXPECT_EQ(check.check(s, 0), SensorCheck::Verdict::Good) << joints;
    // In 209 ms a handle at the fastest believed rate turns twice round: no attitude is a jump.
    s.orientation = Eigen::AngleAxisd(-1.5, Eigen::Vector3d::UnitX());
    EXPECT_EQ(check.check(s, 209 * kMs), SensorCheck::Verdict::Good) << joints;
  }
}

TEST(SensorCheck, AnInsertionMovesNoFasterThanAHand) {
  Capabilities c = all();
  c.joints = true;
  SensorCheck check(c);
  Sample s;
  ASSERT_EQ(check.check(s, 0), SensorCheck::Verdict::Good);
  s.joints[2] = 0.02;  // m in a millisecond: as an angle that were a slow one
  EXPECT_EQ(check.check(s, kMs), SensorCheck::Verdict::Held);
}

TEST(SensorCheck, AClockThatGoesBackMakesNoRoomForAJump) {
  SensorCheck check(cartesian());
  Sample s = at(0.0);
  ASSERT_EQ(check.check(s, 1000 * kMs), SensorCheck::Verdict::Good);
  s = at(1.0);
  EXPECT_EQ(check.check(s, 0), SensorCheck::Verdict::Held);
}

TEST(SensorCheck, HoldingBeginsAnewAfterAGoodReading) {
  SensorCheck check(all());
  for (int ms = 0; ms < 40; ++ms) {
    Sample s = at(ms % 9 == 0 ? 0.0 : 1.0);
    EXPECT_EQ(check.check(s, ms * kMs), ms % 9 == 0 ? SensorCheck::Verdict::Good : SensorCheck::Verdict::Held)
        << ms;
  }
}

TEST(SensorCheck, FastHandsAreBelieved) {
  SensorCheck check(all());
  for (int ms = 0; ms < 200; ++ms) {
    Sample s = at(0.001 * 1.5 * ms);  // 1.5 m/s
    s.orientation = Eigen::AngleAxisd(0.02 * ms, Eigen::Vector3d::UnitZ());
    s.jaw = 0.005 * ms;
    ASSERT_EQ(check.check(s, ms * kMs), SensorCheck::Verdict::Good) << ms;
  }
  EXPECT_EQ(check.rejected(), 0u);
}

TEST(SensorCheck, TheFirstReadingMustBeANumberToo) {
  // Later the bounds on jumps refuse these as well; the first reading has none.
  const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                        -std::numeric_limits<double>::infinity()};
  for (const bool joints : {false, true}) {
    Capabilities c = all();
    c.joints = joints;
    for (int field = joints ? 7 : 0; field < (joints ? 12 : 8); ++field) {
      for (const double value : bad) {
        SensorCheck check(c);
        Sample s = at(0.01);
        spoil(s, joints, field, value);
        EXPECT_EQ(check.check(s, 0), SensorCheck::Verdict::Fault)
            << "there is nothing to hold: field " << field << " value " << value;
        s = at(0.01);
        EXPECT_EQ(check.check(s, kMs), SensorCheck::Verdict::Good) << "the first that is believed";
      }
    }
  }
}

namespace {

// Energy, J, that a spring rendered once a period gives to a handle moved to and fro through it by `v` in a
// closed triangle, less what a damper b takes. Per cycle; the spring is the one that the loop renders.
double cycleEnergy(double stiffness, double damping, double period, double v) {
  HalfSpace tissue;
  tissue.stiffness = stiffness;
  TissueModel model;
  ContactForce contact(1e9);  // no coupling in the way
  const int half = 200;
  double energy = 0.0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  double z = tissue.level - 0.001;
  const double speed_in = -v;
  for (int cycle = 0; cycle < 2; ++cycle) {
    energy = 0.0;
    for (int i = 0; i < 2 * half; ++i) {
      const double speed = i < half ? speed_in : -speed_in;
      const Eigen::Vector3d x(0, 0, z);
      const auto* image = tissue.step(x, i * kMs);
      toModel(image->contacts[0], model);
      contact.reset();
      contact.update(model, x, Eigen::Vector3d::Zero());
      contact.evaluate(x, Eigen::Vector3d::Zero(), period);
      for (int settle = 0; settle < 40; ++settle)
        force = contact.evaluate(x, Eigen::Vector3d::Zero(), period);
      energy += force.z() * speed * period - damping * v * v * period;
      z += speed * period;
    }
  }
  return energy;
}

}  // namespace

TEST(Passivity, ASampledSpringGainsEnergyExactlyBeyondTheBoundOfColgate) {
  const double T = 0.001;
  for (const double K : {200.0, 1000.0, 5000.0}) {
    const double bound = K * T / 2.0;
    EXPECT_GT(cycleEnergy(K, 0.99 * bound, T, 0.05), 0.0) << K;
    EXPECT_LT(cycleEnergy(K, 1.01 * bound, T, 0.05), 0.0) << K;
    EXPECT_NEAR(greatestStiffness(bound, T, 0.0), K, 1e-9);
  }
}

namespace {

// The same with a simulated device that shows each force a while after it was sent. J a cycle.
double cycleEnergyWithDelay(double stiffness, double damping, double period, double delay, double v) {
  SimulatedDevice device;
  device.open({{"delay", std::to_string(delay)}, {"maximum_force", "100"}});
  device.enableForces(true);
  const int half = 2000;  // at its turns the triangle is no even motion
  double energy = 0.0, z = -0.001;
  for (int cycle = 0; cycle < 2; ++cycle) {
    energy = 0.0;
    for (int i = 0; i < 2 * half; ++i) {
      const double speed = i < half ? -v : v;
      device.axis(2).x = z;
      Sample s;
      device.read(s);
      device.write({0, 0, -stiffness * s.position.z(), 0, 0});
      device.advance(period);
      energy += device.shown()[2] * speed * period - damping * v * v * period;
      z += speed * period;
    }
  }
  return energy;
}

}  // namespace

TEST(Passivity, ASampledSpringWithDelayGainsEnergyExactlyBeyondHalfAPeriodPlusTheDelay) {
  const double T = 0.001;
  for (const double delay : {0.001, 0.002, 0.005}) {
    for (const double K : {200.0, 1000.0}) {
      const double bound = K * (T / 2.0 + delay);
      EXPECT_GT(cycleEnergyWithDelay(K, 0.99 * bound, T, delay, 0.05), 0.0) << K << ' ' << delay;
      EXPECT_LT(cycleEnergyWithDelay(K, 1.01 * bound, T, delay, 0.05), 0.0) << K << ' ' << delay;
      EXPECT_NEAR(greatestStiffness(bound, T, delay), K, 1e-9);
      EXPECT_GT(cycleEnergyWithDelay(K, 1.01 * K * T / 2.0, T, delay, 0.05), 0.0)
          << "half a period is not all";
    }
  }
}

TEST(Passivity, TheObserverCountsWhatAHeldForceReallyGives) {
  Passivity p(3, 0.0);
  const Loads shown{0, 0, 2.0, 0, 0};
  const Loads any{0, 0, 0.1, 0, 0};
  p.update({0, 0, 0.5, 0, 0}, any, shown, shown, 1.0, 0.001);
  EXPECT_EQ(p.energy(), 0.0) << "the first place is no motion";
  p.update({0, 0, 0.49, 0, 0}, any, shown, shown, 1.0, 0.001);
  EXPECT_NEAR(p.energy(), 0.02, 1e-12) << "the hand pushed 2 N over 10 mm";
  p.update({0, 0, 0.505, 0, 0}, any, shown, shown, 1.0, 0.001);
  EXPECT_NEAR(p.energy(), -0.01, 1e-12) << "more came back than went in";
  p.update({0, 0, 0.505, 0, 0}, any, shown, Loads{}, 1.0, 0.001);
  EXPECT_EQ(p.energy(), 0.0) << "nothing shown, nothing owed";
}

TEST(Passivity, TheControllerTakesBackExactlyTheExcess) {
  Passivity p(3, 100.0);
  const Loads shown{0, 0, 1.0, 0, 0}, still{}, out_of{0, 0, 0.1, 0, 0}, into{0, 0, -1.1, 0, 0};
  p.update({0, 0, 0, 0, 0}, still, shown, shown, 1.0, 0.001);
  const Loads out = p.update({0, 0, 0.0001, 0, 0}, out_of, shown, shown, 1.0, 0.001);
  // 1 N over 0.1 mm came out of nothing: 0.1 mJ, at 0.1 m/s over 1 ms 10 N·s/m.
  EXPECT_NEAR(p.damping(), 10.0, 1e-9);
  EXPECT_NEAR(out[2], 1.0 - 10.0 * 0.1, 1e-9);
  p.update({0, 0, 0.0001, 0, 0}, still, shown, shown, 1.0, 0.001);
  EXPECT_EQ(p.damping(), 0.0) << "a hand at rest is not damped";
  EXPECT_EQ(p.update({0, 0, -0.001, 0, 0}, into, shown, shown, 1.0, 0.001), shown)
      << "what it gave it may have back";
  Passivity bounded(3, 5.0);
  bounded.update({0, 0, 0, 0, 0}, still, shown, shown, 1.0, 0.001);
  bounded.update({0, 0, 0.0001, 0, 0}, out_of, shown, shown, 1.0, 0.001);
  EXPECT_EQ(bounded.damping(), 5.0);
}

TEST(Passivity, AnAxisThatTurnsIsDampedByItsLever) {
  Passivity p(5, 5.0, {0.12, 0.12, 1.0, 0.01, 0.02});
  const Loads shown{1.0, 0, 0, 0, 0}, turning{2.0, 0, 0, 0, 0};
  p.update({}, {}, shown, shown, 1.0, 0.001);
  const Loads out = p.update({0.002, 0, 0, 0, 0}, turning, shown, shown, 1.0, 0.001);
  // 5 N·s/m at 0.24 m/s and a lever of 0.12 m, not 5 N·m·s/rad.
  EXPECT_NEAR(out[0], 1.0 - 5.0 * 0.12 * 0.12 * 2.0, 1e-12);
}

TEST(Passivity, AStepOfAnEncoderIsNoKick) {
  Passivity p(3, 5.0);
  const Loads shown{0, 0, 0.5, 0, 0};
  Loads x{}, speed{};
  double most = 0.0;
  // 10 mm/s outwards, seen in steps of 50 µm through the loop's low-pass of 3 ms.
  for (int ms = 1; ms < 1000; ++ms) {
    const double before = x[2];
    x[2] = 50e-6 * (ms / 5);
    speed[2] += 0.25 * ((x[2] - before) / 0.001 - speed[2]);
    most = std::max(most, std::abs(p.update(x, speed, shown, shown, 1.0, 0.001)[2] - shown[2]));
  }
  EXPECT_GT(most, 0.0);
  EXPECT_LT(most, 0.1) << "a raw step would be 5 N·s/m times 50 mm/s";
}

TEST(Passivity, FrictionDoesNotSaveUpEnergyForAnInstability) {
  Passivity p(3, 5.0);
  const Loads shown{0, 0, 1.0, 0, 0};
  Loads x{};
  for (int i = 0; i < 1000; ++i) {
    x[2] -= 0.0001;
    p.update(x, {0, 0, -0.1, 0, 0}, shown, shown, 0.01, 0.001);
  }
  EXPECT_LE(p.energy(), 0.01);
}

namespace {

// Own tips 2 ms apart, 1 mm further each, the first at 100 ms.
Registration walked(int poses) {
  Registration r;
  for (int i = 0; i < poses; ++i) r.push((100 + 2 * i) * kMs, {0.001 * i, 0, 0});
  return r;
}

}  // namespace

TEST(Registration, APoseThatWasOnItsWayIsTheSamePlace) {
  Registration r = walked(100);
  EXPECT_TRUE(r.observe(298 * kMs, {0.060, 0, 0}, false)) << "where the hand was 78 ms before";
  EXPECT_TRUE(r.offset().isZero());
}

TEST(Registration, APoseThatTheHandHadTooLongAgoOrOnlyLaterIsAnotherPlace) {
  Registration old = walked(100);
  EXPECT_FALSE(old.observe(298 * kMs, {0.005, 0, 0}, false)) << "188 ms before";
  EXPECT_NEAR(old.offset().x(), 0.005 - 0.099, 1e-12) << "measured from the newest pose";
  Registration later = walked(100);
  EXPECT_FALSE(later.observe(200 * kMs, {0.090, 0, 0}, false)) << "the step was before the hand came there";
  Registration none = walked(100);
  EXPECT_FALSE(none.observe(50 * kMs, {0.0, 0, 0}, false)) << "nothing is known of that time";
  EXPECT_TRUE(none.offset().isZero());
}

TEST(Registration, AHandThatStandsStillTellsTheOffsetExactlyAndAMovingOneDoesNot) {
  Registration r = walked(100);
  EXPECT_FALSE(r.observe(298 * kMs, {0.150, 0, 0}, false)) << "a clutch is let go under way";
  const double guess = r.offset().x();
  EXPECT_TRUE(r.observe(299 * kMs, {0.1485, 0, 0}, false)) << "as the hand was 3 ms before, or 2.5 mm off";
  EXPECT_EQ(r.offset().x(), guess) << "nobody knows which";
  for (int i = 100; i < 200; ++i) r.push((100 + 2 * i) * kMs, {0.099, 0, 0});
  EXPECT_TRUE(r.observe(498 * kMs, {0.148, 0, 0}, false));
  EXPECT_NEAR(r.offset().x(), 0.049, 1e-15);
}

TEST(Registration, WhereAForceIsShownTheOffsetFollowsSlowerThanAHand) {
  Registration r;
  for (int i = 0; i < 200; ++i) r.push(i * kMs, {0, 0, 0});
  r.observe(200 * kMs, {0, 0, 0}, true);
  for (int i = 201; i < 300; ++i) {
    r.push(i * kMs, {0, 0, 0});
    EXPECT_TRUE(r.observe(i * kMs, {0, 0.002, 0}, true));
    ASSERT_NEAR(r.offset().y(), 5e-6 * (i - 200), 1e-12);
  }
  r.push(890 * kMs, {0, 0, 0});
  EXPECT_TRUE(r.observe(900 * kMs, {0, 0.002, 0}, true));
  EXPECT_NEAR(r.offset().y(), 0.002, 1e-15) << "and not beyond";
}

TEST(Capabilities, ANumberThatNoDeviceCanHaveIsNamedWithWhatIsAllowed) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(unsound(cartesian()), "");
  const auto says = [](const Capabilities& c, const char* what) {
    const std::string text = unsound(c);
    EXPECT_EQ(text.rfind(what, 0), 0U) << text;
    EXPECT_NE(text.find("allowed: "), std::string::npos) << text;
  };
  for (const double bad : {nan, inf, -1.0, 0.0, 101.0}) {
    Capabilities c = cartesian();
    c.maximum[0] = bad;
    says(c, "maximum");
    c = cartesian();
    c.joints = true;
    c.maximum = {1.0, 1.0, 1.0, 1.0, bad};
    says(c, "maximum");
  }
  for (const double bad : {nan, inf, -1.0}) {
    Capabilities c = cartesian();
    (c = cartesian()).damping = bad;
    says(c, "damping");  // not a number would lift the bound of Colgate
    (c = cartesian()).stiffness = bad;
    says(c, "stiffness");
    (c = cartesian()).watchdog = bad;
    says(c, "watchdog");
    (c = cartesian()).rate = bad;
    says(c, "rate");
  }
  Capabilities c = cartesian();
  c.buttons = 33;
  says(c, "buttons");
  (c = cartesian()).model.clear();
  says(c, "model");
}

TEST(Options, NumbersHaveAPointWhateverTheLocale) {
  struct Commas : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Commas));
  std::string refusal;
  try {
    EXPECT_EQ(numberOption({{"seconds", "1.5"}}, "seconds", 0.0, 0.0, 2.0), 1.5);
    numberOption({{"seconds", "1,5"}}, "seconds", 0.0, 0.5, 2.0);
  } catch (const DeviceError& e) {
    refusal = e.what();
  }
  std::locale::global(before);
  EXPECT_EQ(refusal, "option 'seconds' = '1,5'; allowed: 0.5 … 2");
}

TEST(Options, ANumberIsOneNumberWithinItsLimitsAndNothingIsTheDefault) {
  for (const char* bad : {"1e999", "1.5x", "x", "-0.1", "2.1", "nan", "inf", " 1"}) {
    EXPECT_THROW(numberOption({{"seconds", bad}}, "seconds", 1.0, 0.0, 2.0), DeviceError) << bad;
  }
  EXPECT_EQ(numberOption({{"seconds", ""}}, "seconds", 1.0, 0.0, 2.0), 1.0);
  EXPECT_EQ(numberOption({}, "seconds", 1.0, 0.0, 2.0), 1.0);
  EXPECT_EQ(option({{"library", ""}}, "library", "libHD.so"), "libHD.so");
}

TEST(Options, AKeyThatADeviceDoesNotKnowIsNamedWithThoseThatItKnows) {
  EXPECT_NO_THROW(checkOptions("arm", {{"port", "a"}, {"rate", "b"}}, "port rate"));
  try {
    checkOptions("arm", {{"port", "a"}, {"prot", "b"}}, "port rate");
    ADD_FAILURE();
  } catch (const DeviceError& e) {
    EXPECT_EQ(std::string(e.what()), "arm: option 'prot' = 'b' is unknown; allowed: port rate");
  }
}

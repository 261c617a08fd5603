#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "nets.h"
#include "vest_tissue/motility/motility.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

constexpr int kRings = 24, kAround = 8;

scene::Description bowel(const motility::Motility& m, bool held = true) {
  specimen::TubeOptions o;
  o.rings = kRings, o.around = kAround, o.radius = 0.01, o.length = 0.12, o.mass = 0.02, o.fix_ends = held;
  o.youngs_modulus = 10e3;
  scene::Description d = specimen::tubeScene(o);
  d.gravity.setZero();
  d.objects[0].motility = m;
  return d;
}

motility::Motility wave(double frequency, double scatter = 0.0, double direction = 1.0) {
  motility::Motility m;
  m.waves[0] = {100.0, 0.0, 2.0, direction, frequency, scatter};
  m.ramp = 0.5;
  return m;
}

/// Mean radius of a ring, m.
double radius(const scene::World& w, int ring) {
  std::vector<float> p(3 * w.knotCount(0));
  w.positions(0, p.data());
  Vector3d centre = Vector3d::Zero();
  std::vector<Vector3d> q;
  for (int i = 0; i < kAround; ++i) {
    const float* const x = p.data() + 3 * (ring * kAround + i);
    q.emplace_back(x[0], x[1], x[2]);
    centre += q.back() / kAround;
  }
  double sum = 0.0;
  for (const auto& x : q) sum += (x - centre).norm() / kAround;
  return sum;
}

/// Phase (turns) of a ring's radius against a cosine of the frequency, and its amplitude, over whole periods.
struct Fit {
  double phase = 0.0, amplitude = 0.0;
};
std::vector<Fit> fits(const scene::Description& d, double frequency, double from, double seconds) {
  scene::World w(d);
  scene::StepInput input;
  scene::StepReport report;
  std::vector<double> c(kRings), s(kRings), mean(kRings);
  int samples = 0;
  const int begin = static_cast<int>(from * 1000), end = begin + static_cast<int>(seconds * 1000);
  for (int i = 0; i < end; ++i) {
    w.step(input, report);
    if (i < begin || i % 20 != 0) continue;
    const double angle = 2.0 * M_PI * frequency * w.time();
    for (int r = 0; r < kRings; ++r) {
      const double x = radius(w, r) - 0.01;
      c[r] += x * std::cos(angle), s[r] += x * std::sin(angle);
    }
    ++samples;
  }
  std::vector<Fit> out(kRings);
  for (int r = 0; r < kRings; ++r) {
    out[r].phase = std::atan2(s[r], c[r]) / (2.0 * M_PI);
    out[r].amplitude = 2.0 * std::hypot(c[r], s[r]) / samples;
  }
  return out;
}

TEST(Motility, WavesTravelAlongTheOrganWithTheirPhaseVelocity) {
  const double frequency = 1.0;  // faster than life: the test is shorter
  for (const double direction : {1.0, -1.0}) {
    const auto fit = fits(bowel(wave(frequency, 0.0, direction)), frequency, 2.0, 3.0);
    // Later by w/n of a period per ring: velocity = frequency·length of a wave.
    double turns = 0.0;
    for (int r = 5; r < 18; ++r) {
      EXPECT_GT(fit[r].amplitude, 1e-5) << "a visible dilatation, ring " << r;
      double step = fit[r + 1].phase - fit[r].phase;
      step -= std::round(step);
      turns += step;
    }
    EXPECT_NEAR(turns / 13.0, direction * 2.0 / kRings, 0.15 * 2.0 / kRings) << "direction " << direction;
  }
}

TEST(Motility, TheOrganDoesNotPushItself) {
  motility::Motility m = wave(1.0);
  m.waves[1] = {50.0, 20.0, 1.3, 1.0, 0.7, 0.1};
  auto d = bowel(m, false);
  for (auto& g : d.objects[0].damping) g = 0.0;
  scene::World w(d);
  scene::StepInput input;
  scene::StepReport report;
  for (int i = 0; i < 3000; ++i) w.step(input, report);
  std::vector<float> v(3 * w.knotCount(0));
  w.velocities(0, v.data());
  Vector3d momentum = Vector3d::Zero();
  double speed = 0.0;
  for (std::size_t i = 0; 3 * i < v.size(); ++i) {
    const Vector3d u(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    momentum += d.objects[0].mass[i] * u;
    speed = std::max(speed, u.norm());
  }
  ASSERT_GT(speed, 1e-4) << "it moves";
  EXPECT_LT(momentum.norm(), 1e-5 * 0.02 * speed) << "kg·m/s: rounding alone";
}

TEST(Motility, ItsTensionFeedsNoVibration) {
  // A ring's tension turns with the ring. With no damping at all what it feeds would grow for ever; the wave
  // itself goes no faster than some millimetres a second.
  motility::Motility m = wave(1.0);
  m.waves[0].pressure = 700;
  m.waves[0].frequency = 0.13;
  m.ramp = 2.0;
  auto d = bowel(m);
  d.gravity.setZero();
  for (auto& g : d.objects[0].damping) g *= 0.1;
  for (auto& l : d.objects[0].links) l.damping *= 0.1;
  scene::World w(d);
  scene::StepReport report;
  double fastest = 0.0;
  std::vector<float> v(3 * w.knotCount(0));
  for (int i = 0; i < 8000; ++i) {
    w.step({}, report);
    w.velocities(0, v.data());
    for (const float x : v) fastest = std::max(fastest, std::fabs(double(x)));
  }
  std::printf("fastest %.1f mm/s\n", 1e3 * fastest);
  EXPECT_LT(fastest, 0.1) << "m/s";
}

TEST(Motility, BeginsGentlyAtRest) {
  motility::Motility m = wave(0.2);
  m.ramp = 5.0;
  scene::World w(bowel(m));
  scene::StepInput input;
  scene::StepReport report;
  double fastest = 0.0;
  std::vector<float> v(3 * w.knotCount(0));
  for (int i = 0; i < 2000; ++i) {
    w.step(input, report);
    w.velocities(0, v.data());
    for (const float x : v) fastest = std::max(fastest, std::fabs(double(x)));
  }
  EXPECT_GT(fastest, 1e-7);
  EXPECT_LT(fastest, 1e-3);
}

TEST(Motility, DrawsAreMadeOncePerPeriodAndDependOnSeedAndOrganAlone) {
  const motility::Wave w{100.0, 40.0, 1.0, 1.0, 0.1, 0.05};
  EXPECT_EQ(motility::frequencyAt(w, 3.01, 7, 2), motility::frequencyAt(w, 3.99, 7, 2));
  EXPECT_NE(motility::frequencyAt(w, 3.01, 7, 2), motility::frequencyAt(w, 4.01, 7, 2));
  EXPECT_NE(motility::frequencyAt(w, 3.01, 7, 2), motility::frequencyAt(w, 3.01, 8, 2));
  EXPECT_NE(motility::frequencyAt(w, 3.01, 7, 2), motility::frequencyAt(w, 3.01, 7, 3));
  double least = 1e9, most = 0.0, sum = 0.0;
  for (int period = 0; period < 4000; ++period) {
    const double f = motility::frequencyAt(w, period + 0.5, 1, 0), a = motility::amplitudeAt(w, period, 1, 0);
    EXPECT_GE(f, 0.1);
    EXPECT_LE(f, 0.15);
    least = std::min(least, a), most = std::max(most, a);
    sum += a / 4000.0;
    EXPECT_NEAR(motility::amplitudeAt(w, period + 0.9999999, 1, 0),
                motility::amplitudeAt(w, period + 1.0, 1, 0), 1e-4)
        << "no jump between periods";
  }
  EXPECT_NEAR(sum, 100.0, 2.0);
  EXPECT_GT(least, 60.0 - 1e-9);
  EXPECT_LT(most, 140.0 + 1e-9);
  EXPECT_GT(most - least, 70.0);
}

TEST(Motility, PresetsKeepPhysiologicalRates) {
  const double limits[][2] = {{1, 3}, {8, 11}, {3, 8}, {1.2, 2.3}};  // per minute, as motility.h says
  for (std::size_t i = 0; i < motility::kPresets.size(); ++i) {
    motility::Motility m;
    ASSERT_TRUE(motility::preset(motility::kPresets[i], m));
    EXPECT_TRUE(m.active());
    for (const auto& w : m.waves) {
      if (w.pressure == 0.0) continue;
      EXPECT_NEAR(60.0 * w.frequency, limits[i][0], 1e-9) << motility::kPresets[i];
      EXPECT_NEAR(60.0 * (w.frequency + w.frequency_scatter), limits[i][1], 1e-9) << motility::kPresets[i];
    }
  }
  motility::Motility m;
  EXPECT_FALSE(motility::preset("stomach", m));
}

TEST(Motility, HashesAreTheSameForAnyThreadsAndAfterRestore) {
  const auto hash = [](int threads, bool restored) {
    const auto d = bowel(wave(0.8, 0.4));
    scene::World w(d, threads);
    scene::StepInput input;
    scene::StepReport report;
    for (int i = 0; i < 1700; ++i) w.step(input, report);
    if (restored) {
      std::vector<std::uint8_t> bytes;
      w.save(bytes);
      scene::World other(d, threads);
      other.restore(bytes);
      w = std::move(other);
    }
    for (int i = 0; i < 800; ++i) w.step(input, report);
    return w.stateHash();
  };
  const auto reference = hash(1, false);
  EXPECT_EQ(hash(2, false), reference);
  EXPECT_EQ(hash(4, false), reference);
  EXPECT_EQ(hash(2, true), reference);
}

}  // namespace

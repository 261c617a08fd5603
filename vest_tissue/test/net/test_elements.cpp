#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "vest_tissue/material/law.h"
#include "vest_tissue/net/elements.h"

namespace {

using namespace vest::net;

struct Knots {
  std::vector<float> x, y, z, vx, vy, vz, fx, fy, fz;
  explicit Knots(std::size_t n) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> place(-0.01f, 0.01f);
    for (auto* v : {&x, &y, &z, &vx, &vy, &vz})
      for (std::size_t i = 0; i < n; ++i) v->push_back(place(random));
    for (auto* v : {&fx, &fy, &fz}) v->assign(n, 0.0f);
  }
  ElementArrays arrays() {
    return {x.data(), y.data(), z.data(), vx.data(), vy.data(), vz.data(), fx.data(), fy.data(), fz.data()};
  }
};

/// Force against the negative gradient of the energy by central differences, and no net force and torque.
void expectGradient(Knots k, const std::function<void(const ElementArrays&)>& forces,
                    const std::function<double(const ElementArrays&)>& energy, bool closed = true) {
  for (auto* v : {&k.vx, &k.vy, &k.vz}) std::fill(v->begin(), v->end(), 0.0f);
  forces(k.arrays());
  double largest = 0.0, sum[3] = {}, torque[3] = {};
  for (std::size_t i = 0; i < k.x.size(); ++i) {
    const double p[3] = {k.x[i], k.y[i], k.z[i]}, f[3] = {k.fx[i], k.fy[i], k.fz[i]};
    for (int a = 0; a < 3; ++a) {
      largest = std::max(largest, std::fabs(f[a]));
      sum[a] += f[a];
      torque[a] += p[(a + 1) % 3] * f[(a + 2) % 3] - p[(a + 2) % 3] * f[(a + 1) % 3];
    }
  }
  ASSERT_GT(largest, 0.0);
  const float step = 2e-5f;
  for (std::size_t i = 0; i < k.x.size(); ++i) {
    int axis = 0;
    for (auto* v : {&k.x, &k.y, &k.z}) {
      const float keep = (*v)[i], f = axis == 0 ? k.fx[i] : axis == 1 ? k.fy[i] : k.fz[i];
      (*v)[i] = keep + step;
      const float above = (*v)[i];
      const double more = energy(k.arrays());
      (*v)[i] = keep - step;
      const float below = (*v)[i];
      const double less = energy(k.arrays());
      (*v)[i] = keep;
      EXPECT_NEAR(f, -(more - less) / (static_cast<double>(above) - below), 0.01 * largest)
          << "knot " << i << " axis " << axis;
      ++axis;
    }
  }
  if (!closed) return;
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(sum[a], 0.0, 1e-5 * largest);
    EXPECT_NEAR(torque[a], 0.0, 1e-6 * largest);
  }
}

TEST(Elements, BendingForceIsTheNegativeGradientOfItsEnergyForStraightAndBentRest) {
  for (const float rest : {0.0f, 0.7f}) {
    const std::vector<Bending> e{{0, 1, 2, 2e-4f, rest}, {1, 2, 3, 1e-4f, rest}};
    expectGradient(
        Knots(4), [&](const ElementArrays& a) { addBending(e, a); },
        [&](const ElementArrays& a) { return bendingEnergy(e, a); });
  }
}

TEST(Elements, AStraightBendingElementWithStraightRestHasNoForceAndStaysFinite) {
  Knots k(3);
  for (int i = 0; i < 3; ++i) k.x[i] = 0.01f * i, k.y[i] = k.z[i] = 0.0f;
  addBending({{0, 1, 2, 1.0f, 0.0f}}, k.arrays());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(std::fabs(k.fx[i]) + std::fabs(k.fy[i]) + std::fabs(k.fz[i]), 0.0f);
  addBending({{0, 1, 2, 1.0f, 0.5f}}, k.arrays());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(std::isfinite(k.fx[i]) && std::isfinite(k.fy[i]));
}

TEST(Elements, HingeForceIsTheNegativeGradientOfItsEnergyOnEveryKernelLevel) {
  Knots k(4);
  const float place[4][3] = {{0, 0, 0}, {0.01f, 0, 0}, {0.004f, 0.008f, 0.002f}, {0.006f, -0.009f, 0.003f}};
  for (int i = 0; i < 4; ++i) k.x[i] = place[i][0], k.y[i] = place[i][1], k.z[i] = place[i][2];
  const std::vector<Hinge> e{{0, 1, 2, 3, 3e-5f, 0.3f}};
  for (const auto level : {KernelLevel::Baseline, chooseKernelLevel()}) {
    expectGradient(
        k, [&](const ElementArrays& a) { addHinges(e, a, level); },
        [&](const ElementArrays& a) { return hingeEnergy(e, a); });
  }
}

TEST(Elements, HingeForcesHaveTheSameBitsOnEveryKernelLevel) {
  Knots a(64), b(64);
  std::vector<Hinge> e;
  for (std::uint32_t i = 0; i + 3 < 64; ++i) e.push_back({i, i + 1, i + 2, i + 3, 1e-4f, 0.1f});
  addHinges(e, a.arrays(), KernelLevel::Baseline);
  addHinges(e, b.arrays(), chooseKernelLevel());
  for (int i = 0; i < 64; ++i) {
    EXPECT_EQ(a.fx[i], b.fx[i]);
    EXPECT_EQ(a.fy[i], b.fy[i]);
    EXPECT_EQ(a.fz[i], b.fz[i]);
  }
}

TEST(Elements, ACrushedHingeFadesWithoutANetForceOrTorque) {
  // One wing is crushed to a tenth of the height below which moments fade, the other one is whole.
  Knots k(4);
  k.x = {0.0f, 0.010f, 0.004f, 0.006f};
  k.y = {0.0f, 0.0f, 0.0002f, -0.006f};
  k.z = {0.0f, 0.0f, 0.0001f, 0.004f};
  const std::vector<Hinge> hinges{{0, 1, 2, 3, 1e-4f, 0.0f, 0.002f * 0.002f}};
  for (const auto level : {KernelLevel::Baseline, chooseKernelLevel()}) {
    for (auto* v : {&k.fx, &k.fy, &k.fz}) std::fill(v->begin(), v->end(), 0.0f);
    addHinges(hinges, k.arrays(), level);
    double sum[3] = {}, torque[3] = {}, largest = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double p[3] = {k.x[i], k.y[i], k.z[i]}, f[3] = {k.fx[i], k.fy[i], k.fz[i]};
      for (int a = 0; a < 3; ++a) {
        largest = std::max(largest, std::fabs(f[a]));
        sum[a] += f[a];
        torque[a] += p[(a + 1) % 3] * f[(a + 2) % 3] - p[(a + 2) % 3] * f[(a + 1) % 3];
      }
    }
    ASSERT_GT(largest, 1e-6);
    for (int a = 0; a < 3; ++a) {
      EXPECT_NEAR(sum[a], 0.0, 1e-5 * largest);
      EXPECT_NEAR(torque[a], 0.0, 1e-5 * largest * 0.01);
    }
  }
}

TEST(Elements, PlasticForceIsTheNegativeGradientOfItsEnergyInsideTheRampAndBeyond) {
  Knots k(2);
  k.x = {0, 0.01f}, k.y = {0, 0.002f}, k.z = {0, 0.001f};
  const float length = std::sqrt(0.01f * 0.01f + 0.002f * 0.002f + 0.001f * 0.001f);
  for (const float rest : {length * 0.9f, length * 0.995f, length * 1.1f}) {
    const std::vector<Plastic> e{{0, 1, 0.2f, rest, 0.0f}};
    expectGradient(
        k, [&](const ElementArrays& a) { addPlastic(e, a); },
        [&](const ElementArrays& a) { return plasticEnergy(e, a); });
  }
}

TEST(Elements, TetherForceIsTheNegativeGradientOfItsEnergy) {
  const std::vector<Tether> e{{1, {0.01f, 0.02f, 0.0f}, 30.0f, 0.0f}};
  expectGradient(
      Knots(2), [&](const ElementArrays& a) { addTethers(e, a); },
      [&](const ElementArrays& a) { return tetherEnergy(e, a); }, false);
}

TEST(Elements, VolumePressureIsTheNegativeGradientOfItsEnergyOnAClosedSurface) {
  Knots k(4);
  k.x = {0, 0.01f, 0, 0}, k.y = {0, 0, 0.01f, 0}, k.z = {0, 0, 0, 0.01f};
  Volume v;
  v.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  v.knots = {0, 1, 2, 3};
  v.bulk_modulus = 5e4f;
  v.rest = 1.5e-7f;
  const std::vector<Volume> e{v};
  expectGradient(
      k, [&](const ElementArrays& a) { addVolumes(e, a); },
      [&](const ElementArrays& a) { return volumeEnergy(e, a); });
  float gradient[12];
  std::vector<PackedKnot> packed(4);
  EXPECT_NEAR(volumeGradient(v, k.arrays(), gradient, 4, packed), enclosedVolume(v, k.arrays()), 1e-12);
  EXPECT_NEAR(enclosedVolume(v, k.arrays()), 1e-6 / 6, 1e-10);
}

TEST(Elements, DampersOnlyTakeEnergyOut) {
  Knots k(4);
  Elements e;
  e.plastic = {{0, 1, 0.0f, 0.01f, 0.3f}};
  e.tethers = {{2, {0, 0, 0}, 0.0f, 0.4f}};
  addElements(e, k.arrays(), KernelLevel::Baseline);
  double power = 0.0;
  for (int i = 0; i < 4; ++i)
    power += double(k.fx[i]) * k.vx[i] + double(k.fy[i]) * k.vy[i] + double(k.fz[i]) * k.vz[i];
  EXPECT_LT(power, 0.0);
  EXPECT_NEAR(-power, elementDissipation(e, k.arrays()), 1e-6 * -power);
}

TEST(Elements, TheAngleAgreesWithTheArctangentAllRound) {
  for (double phi = -3.1; phi < 3.1; phi += 0.01) {
    EXPECT_NEAR(angleOf(static_cast<float>(std::sin(phi)), static_cast<float>(std::cos(phi))), phi, 2e-6);
  }
}

TEST(Law, StressIsTheDerivativeOfTheEnergyAndTheTangentThatOfTheStress) {
  const vest::material::Law law{1000.0, 1.0, 4.0, 10.0, 0.4};
  ASSERT_TRUE(vest::material::isMonotone(law));
  for (double e = -0.3; e < 0.7; e += 0.013) {
    const double h = 1e-6;
    EXPECT_NEAR(
        vest::material::stress(law, e),
        (vest::material::energyDensity(law, e + h) - vest::material::energyDensity(law, e - h)) / (2 * h),
        1e-3);
    EXPECT_NEAR(vest::material::tangent(law, e),
                (vest::material::stress(law, e + h) - vest::material::stress(law, e - h)) / (2 * h), 1.0);
  }
  EXPECT_FALSE(vest::material::isMonotone({1000.0, -3.0, 0.0, 0.0, 0.5}))
      << "a falling stress would be unstable";
}

}  // namespace

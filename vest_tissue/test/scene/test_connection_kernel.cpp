// Protects the connections that are found four at a time: each lane as if it were alone, the same bits from
// each level of the processor, and forces without a sum or a torque.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include <Eigen/Geometry>

#include "../../src/scene/connection_kernel.h"

namespace vest::scene::kernel {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kLanes = ConnectionLanes::kCount;

/// A knot some millimetres from a face some millimetres wide, as those of vessels and organs.
void fill(ConnectionLanes& l, std::size_t lane, std::mt19937& random) {
  const auto near = [&](double about, double by) {
    return about + by * (2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0);
  };
  for (std::size_t e = 0; e < 3; ++e) {
    l.x0[e][lane] = static_cast<float>(near(0.05, 0.004)), l.v0[e][lane] = static_cast<float>(near(0, 0.1));
    for (std::size_t i = 0; i < 3; ++i) {
      l.x1[i][e][lane] = static_cast<float>(near(i == e ? 0.055 : 0.05, 0.001));
      l.v1[i][e][lane] = static_cast<float>(near(0, 0.1));
    }
    l.w1[e][lane] = static_cast<float>(near(1e5, 5e4));
  }
  l.w0[lane] = static_cast<float>(near(1e5, 5e4));
  l.ahead0[lane] = near(1.5e-4, 1e-4), l.ahead1[lane] = near(1.5e-4, 1e-4);
  l.weight[0][lane] = near(0.4, 0.3), l.weight[1][lane] = near(0.3, 0.2);
  l.weight[2][lane] = 1.0 - l.weight[0][lane] - l.weight[1][lane];
  l.height[lane] = near(0, 0.002);
  l.strand[lane] = lane % 2 == 0 ? 0.0 : near(0.002, 0.001);
  l.built[lane] = near(3e5, 2e5), l.stiffness[lane] = near(60, 40), l.damping[lane] = near(0.02, 0.01);
}

template <class Number, std::size_t n>
void move(Number (&to)[n], std::size_t a, const Number (&from)[n], std::size_t b) {
  to[a] = from[b];
}
template <class Part, std::size_t n, std::size_t m>
void move(Part (&to)[m][n], std::size_t a, const Part (&from)[m][n], std::size_t b) {
  for (std::size_t k = 0; k < m; ++k) move(to[k], a, from[k], b);
}
void copyLane(ConnectionLanes& to, std::size_t a, const ConnectionLanes& from, std::size_t b) {
  const auto both = [&](auto ConnectionLanes::*part) { move(to.*part, a, from.*part, b); };
  both(&ConnectionLanes::x0), both(&ConnectionLanes::v0), both(&ConnectionLanes::x1),
      both(&ConnectionLanes::v1), both(&ConnectionLanes::w0), both(&ConnectionLanes::w1),
      both(&ConnectionLanes::ahead0), both(&ConnectionLanes::ahead1), both(&ConnectionLanes::weight),
      both(&ConnectionLanes::height), both(&ConnectionLanes::strand), both(&ConnectionLanes::built),
      both(&ConnectionLanes::stiffness), both(&ConnectionLanes::damping);
}

Vector3d of(const float (&from)[3][kLanes], std::size_t lane) {
  return {from[0][lane], from[1][lane], from[2][lane]};
}

TEST(ConnectionKernel, FourConnectionsAreEachAsIfAlone) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    ConnectionLanes four{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) fill(four, lane, random);
    ConnectionLanes together = four;
    pull(together, net::KernelLevel::Baseline);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      ConnectionLanes alone{};
      copyLane(alone, 3 - lane, four, lane);
      pull(alone, net::KernelLevel::Baseline);
      for (std::size_t e = 0; e < 3; ++e) {
        EXPECT_EQ(together.on0[e][lane], alone.on0[e][3 - lane]);
        EXPECT_EQ(together.spring[e][lane], alone.spring[e][3 - lane]);
        for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(together.on1[i][e][lane], alone.on1[i][e][3 - lane]);
      }
    }
  }
}

TEST(ConnectionKernel, EachLevelOfTheProcessorGivesTheSameBits) {
  const net::KernelLevel best = net::chooseKernelLevel();
  std::mt19937 random(8);
  for (int round = 0; round < 200; ++round) {
    ConnectionLanes a{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) fill(a, lane, random);
    if (round % 10 == 0)  // a face that has fallen to a line
      for (std::size_t e = 0; e < 3; ++e) a.x1[2][e][1] = a.x1[1][e][1], a.v1[2][e][1] = a.v1[1][e][1];
    ConnectionLanes b = a;
    pull(a, net::KernelLevel::Baseline), pull(b, best);
    EXPECT_EQ(0, std::memcmp(&a, &b, sizeof a));
  }
}

TEST(ConnectionKernel, ForcesHaveNoSumAndNoTorqueWhereTheyAct) {
  std::mt19937 random(9);
  for (int round = 0; round < 200; ++round) {
    ConnectionLanes l{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) fill(l, lane, random), l.strand[lane] = 0.0;
    pull(l, net::KernelLevel::Baseline);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const Vector3d force = of(l.on0, lane);
      Vector3d sum = force, torque = (of(l.x0, lane) + l.ahead0[lane] * of(l.v0, lane)).cross(force);
      double size = force.norm();
      for (std::size_t i = 0; i < 3; ++i) {
        const Vector3d f = of(l.on1[i], lane);
        sum += f, size += f.norm();
        torque += (of(l.x1[i], lane) + l.ahead1[lane] * of(l.v1[i], lane)).cross(f);
      }
      ASSERT_GT(size, 0.0);
      // Forces are kept in single precision: 6e-8 of each.
      EXPECT_LT(sum.norm(), 3e-7 * size);
      // The spring pulls along the way between its ends, the damper acts at end 0: no lever is left.
      EXPECT_LT(torque.norm(), 3e-7 * 0.1 * size);
    }
  }
}

}  // namespace
}  // namespace vest::scene::kernel

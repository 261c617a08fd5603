#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <set>

#include "seed_net.h"
#include "vest_tissue/net/link_kernel.h"

using vest::net::KernelLevel;
using vest::net::KernelLink;
using vest::net::KnotArrays;
using vest::net::LinkTable;

namespace {

constexpr std::size_t kPadding = 2 * vest::net::kLanes;

struct Knots {
  std::vector<float> x, y, z, vx, vy, vz, fx, fy, fz, packed;
  explicit Knots(std::size_t n) {
    for (auto* v : {&x, &y, &z, &vx, &vy, &vz, &fx, &fy, &fz}) v->assign(n + kPadding, 0.0f);
    packed.assign(vest::net::kPackedFloats * (n + kPadding), NAN);
  }
  KnotArrays arrays() {
    return {x.data(),  y.data(),  z.data(),  vx.data(), vy.data(),
            vz.data(), fx.data(), fy.data(), fz.data(), packed.data()};
  }
};

vest::material::Law softLaw() {
  vest::material::Law law;
  law.youngs_modulus = 1;
  law.a2 = 1.5;
  law.a3 = -0.5;
  law.a4 = 7.0;
  law.max_strain = 0.4;
  return law;
}

Knots shaken(const vest::specimen::Tube& tube, unsigned seed) {
  const std::size_t n = tube.x.size() - kPadding;
  Knots k(n);
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-0.002f, 0.002f), speed(-0.1f, 0.1f);
  for (std::size_t i = 0; i < n; ++i) {
    k.x[i] = tube.x[i] + place(random);
    k.y[i] = tube.y[i] + place(random);
    k.z[i] = tube.z[i] + place(random);
    k.vx[i] = speed(random);
    k.vy[i] = speed(random);
    k.vz[i] = speed(random);
  }
  return k;
}

}  // namespace

TEST(LinkKernel, SeedNetHasTheSeedsCountsAndNoDuplicateLink) {
  std::size_t knots = 0, links = 0;
  for (const auto& tube : vest::specimen::makeSeedNet(1, 0)) {
    knots += tube.x.size() - kPadding;
    links += tube.links.size();
    std::set<std::pair<unsigned, unsigned>> seen;
    for (const KernelLink& l : tube.links) {
      EXPECT_TRUE(seen.insert({std::min(l.knot0, l.knot1), std::max(l.knot0, l.knot1)}).second);
    }
  }
  EXPECT_EQ(knots, 2751u);
  EXPECT_EQ(links, 10942u);
}

TEST(LinkKernel, ForceIsThatOfTheLawInDoublePrecision) {
  const vest::material::Law law = softLaw();
  for (const auto& tube : vest::specimen::makeSeedNet(3.0f, 0.02f)) {
    Knots k = shaken(tube, 7);
    const LinkTable table(tube.links, law);
    addLinkForces(table, k.arrays(), KernelLevel::Baseline);
    std::vector<std::array<double, 3>> expected(k.x.size(), {0, 0, 0});
    for (const KernelLink& l : tube.links) {
      const double d[3] = {double(k.x[l.knot1]) - k.x[l.knot0], double(k.y[l.knot1]) - k.y[l.knot0],
                           double(k.z[l.knot1]) - k.z[l.knot0]};
      const double u[3] = {double(k.vx[l.knot1]) - k.vx[l.knot0], double(k.vy[l.knot1]) - k.vy[l.knot0],
                           double(k.vz[l.knot1]) - k.vz[l.knot0]};
      const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      const double e = length / l.rest - 1;
      double sigma = e;
      if (e > 0) {
        const double c = std::min(e, law.max_strain);
        const double m = law.max_strain;
        const double slope = 1 + 2 * law.a2 * m + 3 * law.a3 * m * m + 4 * law.a4 * m * m * m;
        sigma = c * (1 + law.a2 * c + law.a3 * c * c + law.a4 * c * c * c) + slope * (e - c);
      }
      const double rate = (u[0] * d[0] + u[1] * d[1] + u[2] * d[2]) / length;
      const double s = (l.axial * sigma + l.damping * rate) / length;
      for (int a = 0; a < 3; ++a) {
        expected[l.knot0][a] += s * d[a];
        expected[l.knot1][a] -= s * d[a];
      }
    }
    for (std::size_t i = 0; i + kPadding < k.x.size(); ++i) {
      EXPECT_NEAR(k.fx[i], expected[i][0], 2e-4);
      EXPECT_NEAR(k.fy[i], expected[i][1], 2e-4);
      EXPECT_NEAR(k.fz[i], expected[i][2], 2e-4);
    }
  }
}

TEST(LinkKernel, EveryLevelGivesTheSameBits) {
  if (vest::net::chooseKernelLevel() == KernelLevel::Baseline) {
    RecordProperty("note", "this processor, or VEST_KERNEL, offers the baseline alone");
  }
  for (const auto& tube : vest::specimen::makeSeedNet(3.0f, 0.02f)) {
    Knots a = shaken(tube, 11);
    Knots b = a;
    const LinkTable table(tube.links, softLaw());
    for (int n = 0; n < 3; ++n) {
      addLinkForces(table, a.arrays(), KernelLevel::Baseline);
      addLinkForces(table, b.arrays(), vest::net::chooseKernelLevel());
    }
    EXPECT_EQ(std::memcmp(a.fx.data(), b.fx.data(), a.fx.size() * sizeof(float)), 0);
    EXPECT_EQ(std::memcmp(a.fy.data(), b.fy.data(), a.fy.size() * sizeof(float)), 0);
    EXPECT_EQ(std::memcmp(a.fz.data(), b.fz.data(), a.fz.size() * sizeof(float)), 0);
  }
}

TEST(LinkKernel, LinksWithoutRunsGiveTheSameBitsPackedOrNotAndAtEveryLevel) {
  for (const auto& tube : vest::specimen::makeSeedNet(3.0f, 0.02f)) {
    const std::size_t n = tube.x.size() - kPadding;
    std::vector<std::uint32_t> map(n);
    for (std::size_t i = 0; i < n; ++i) map[i] = static_cast<std::uint32_t>(i);
    std::shuffle(map.begin(), map.end(), std::mt19937(3));
    auto links = tube.links;
    for (KernelLink& l : links) l = {map[l.knot0], map[l.knot1], l.rest, l.axial, l.damping};
    LinkTable table(links, softLaw(), 20);
    ASSERT_TRUE(table.addLink({static_cast<std::uint32_t>(n - 1), 0, 0.01f, 2.0f, 0.1f}));
    Knots a = shaken(tube, 11);
    for (std::size_t i = 0; i < n; ++i) a.fx[i] = 1e-3f * static_cast<float>(i), a.fz[i] = -0.5f;
    Knots b = a, c = a;
    for (int round = 0; round < 2; ++round) {
      addLinkForces(table, a.arrays(), KernelLevel::Baseline);
      addLinkForces(table, b.arrays(), vest::net::chooseKernelLevel());
      KnotArrays without = c.arrays();
      without.packed = nullptr;
      addLinkForces(table, without, vest::net::chooseKernelLevel());
    }
    for (const Knots* other : {&b, &c}) {
      EXPECT_EQ(std::memcmp(a.fx.data(), other->fx.data(), n * sizeof(float)), 0);
      EXPECT_EQ(std::memcmp(a.fy.data(), other->fy.data(), n * sizeof(float)), 0);
      EXPECT_EQ(std::memcmp(a.fz.data(), other->fz.data(), n * sizeof(float)), 0);
    }
  }
}

TEST(LinkKernel, LinksNumberedAlongTheTubeBecomeRunsAndShuffledOnesGiveTheSameForce) {
  const auto tube = vest::specimen::makeSeedNet(3.0f, 0.02f).front();
  const LinkTable runs(tube.links, softLaw());
  EXPECT_GE(runs.runCount(), 4u);
  EXPECT_GT(runs.occupancy(), 0.8);
  // The same net with its knots renumbered at random has no runs left.
  const std::size_t n = tube.x.size() - kPadding;
  std::vector<std::uint32_t> map(n);
  for (std::size_t i = 0; i < n; ++i) map[i] = static_cast<std::uint32_t>(i);
  std::shuffle(map.begin(), map.end(), std::mt19937(3));
  auto links = tube.links;
  for (KernelLink& l : links) l = {map[l.knot0], map[l.knot1], l.rest, l.axial, l.damping};
  const LinkTable shuffled(links, softLaw());
  EXPECT_LT(shuffled.runCount(), 5u);
  Knots a = shaken(tube, 5);
  Knots b(n);
  for (std::size_t i = 0; i < n; ++i) {
    b.x[map[i]] = a.x[i];
    b.y[map[i]] = a.y[i];
    b.z[map[i]] = a.z[i];
    b.vx[map[i]] = a.vx[i];
    b.vy[map[i]] = a.vy[i];
    b.vz[map[i]] = a.vz[i];
  }
  addLinkForces(runs, a.arrays(), vest::net::chooseKernelLevel());
  addLinkForces(shuffled, b.arrays(), vest::net::chooseKernelLevel());
  for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(a.fx[i], b.fx[map[i]], 1e-5);
}

TEST(LinkKernel, LinksBetweenHeldKnotsAreLeftOutAndAllOthersPullAsBefore) {
  for (const auto& tube : vest::specimen::makeSeedNet(3.0f, 0.02f)) {
    const std::size_t knots = tube.x.size() - kPadding;
    std::vector<std::uint8_t> held(knots, 0);
    for (std::size_t i = 0; i < knots / 2; ++i) held[i] = 1;
    Knots k = shaken(tube, 7), whole = k;
    LinkTable table(tube.links, softLaw(), 8, held);
    const LinkTable all(tube.links, softLaw(), 8);
    EXPECT_LT(table.places().size() + table.indexedBlocks(), all.places().size() + all.indexedBlocks());
    for (std::size_t n = 0; n < tube.links.size(); ++n)  // one left out stays so
      table.setLink(n, tube.links[n].rest, tube.links[n].axial, tube.links[n].damping);
    addLinkForces(table, k.arrays(), KernelLevel::Baseline);
    addLinkForces(all, whole.arrays(), KernelLevel::Baseline);
    double held_sum = 0, whole_sum = 0;
    for (std::size_t i = 0; i < knots; ++i) {
      if (held[i] == 0) {
        EXPECT_NEAR(k.fx[i], whole.fx[i], 2e-4) << i;
      } else {
        held_sum += k.fx[i], whole_sum += whole.fx[i];
      }
    }
    EXPECT_NEAR(held_sum, whole_sum, 1e-3) << "what the attachments take up";
  }
}

TEST(LinkKernel, DeadLinkPullsNoMore) {
  Knots k(2);
  k.x[1] = 0.02f;
  LinkTable table({{0, 1, 0.01f, 1.0f, 0.0f}}, softLaw());
  addLinkForces(table, k.arrays(), vest::net::chooseKernelLevel());
  EXPECT_GT(k.fx[0], 0.9f);
  EXPECT_EQ(k.fx[0], -k.fx[1]);
  table.setLink(0, 0.01f, 0.0f, 0.0f);
  k.fx[0] = k.fx[1] = 0;
  addLinkForces(table, k.arrays(), vest::net::chooseKernelLevel());
  EXPECT_EQ(k.fx[0], 0.0f);
  EXPECT_EQ(k.fx[1], 0.0f);
}

TEST(LinkKernel, KnotsThatCoincideGiveAFiniteForce) {
  Knots k(2);
  const LinkTable table({{0, 1, 0.01f, 1.0f, 0.1f}}, softLaw());
  addLinkForces(table, k.arrays(), vest::net::chooseKernelLevel());
  for (int i = 0; i < 2; ++i)
    EXPECT_TRUE(std::isfinite(k.fx[i]) && std::isfinite(k.fy[i]) && std::isfinite(k.fz[i]));
}

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "blades.h"
#include "slab.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

// Protects that tissue does not pass through itself, nor through what it is tied to elsewhere, nor between
// the knots of what is thin; and that such contacts keep momentum.

namespace {

using namespace vest;
using Eigen::Vector3d;

/// The place that a straight thing along x has when it is bent to a U in the plane of x and y: two limbs of
/// length `limb`, 2·radius apart, the first along the x axis from the origin.
Vector3d bent(const Vector3d& p, double limb, double radius) {
  const double arc = M_PI * radius;
  if (p.x() < limb) return p;
  if (p.x() < limb + arc) {
    const double phi = (p.x() - limb) / radius, r = radius - p.y();
    return {limb + r * std::sin(phi), radius - r * std::cos(phi), p.z()};
  }
  return {2 * limb + arc - p.x(), 2 * radius - p.y(), p.z()};
}

constexpr double kLimb = 0.06, kRadius = 0.008;  // m

/// A tube bent to a U, its first limb held.
scene::Object loop(bool held) {
  specimen::TubeOptions o;
  o.rings = 36, o.around = 6, o.radius = 0.003, o.mass = 0.006;
  o.length = 2 * kLimb + M_PI * kRadius - 0.015, o.centre = Vector3d(o.length / 2, 0, 0);
  o.youngs_modulus = 10e3, o.knot_damping = held ? 2e-4 : 0.0;
  o.fix_ends = false;
  scene::Object t = specimen::tube(o);
  for (auto& x : t.position) x = bent(x, kLimb, kRadius);
  t.rest_position = t.position;
  for (auto& l : t.links) l.rest = (t.position[l.knot0] - t.position[l.knot1]).norm();
  for (std::size_t k = 0; held && k < 84; ++k) t.fixed[k] = 1;
  return t;
}

/// The same of elements: a bar of 6 by 6 mm.
scene::Object bar(bool held, fem::Strain strain, fem::Motion motion = fem::Motion::BackwardEuler) {
  fem::Description d = fem::specimen::makeBox({48, 2, 2, 2 * kLimb + M_PI * kRadius, 0.006, 0.006}, false);
  d.name = "bar", d.strain = strain, d.motion = motion;
  d.material = {10e3, 0.4, 1000.0, held ? 2.0 : 0.0, held ? 0.002 : 0.0};
  for (fem::Index n = 0; n < d.nodes.size(); ++n) {
    if (held && d.nodes[n].x() < 0.8 * kLimb) d.fixed.push_back(n);
    d.nodes[n] = bent(d.nodes[n] - Vector3d(0, 0.003, 0.003), kLimb, kRadius);
  }
  return fem::specimen::object(d);
}
constexpr std::uint32_t kSlice = 9;  // its knots of one cross-section

scene::Description sceneOf(std::vector<scene::Object> objects) {
  scene::Description d;
  d.name = "folds", d.gravity.setZero();
  d.objects = std::move(objects);
  for (auto& o : d.objects) o.full_contact = true;
  return d;
}

bool pierces(const Vector3d& a, const Vector3d& b, const std::array<Vector3d, 3>& p) {
  const Vector3d n = (p[1] - p[0]).cross(p[2] - p[0]);
  const double da = n.dot(a - p[0]), db = n.dot(b - p[0]);
  if ((da > 0) == (db > 0)) return false;
  const Vector3d x = a + da / (da - db) * (b - a);
  for (int e = 0; e < 3; ++e)
    if (n.dot((p[(e + 1) % 3] - p[e]).cross(x - p[e])) < 0) return false;
  return true;
}

/// How often an edge of the surface of one object goes through a triangle of the other, found by trying all:
/// of one with itself where their knots have numbers that differ by more than `apart`. Knots before `from` do
/// not count.
int piercings(const scene::World& w, std::size_t a, std::size_t b, std::uint32_t apart = 0,
              std::uint32_t from = 0) {
  int count = 0;
  for (const auto& edge : w.contactTriangles(a)) {
    for (int e = 0; e < 3; ++e) {
      const Vector3d p = w.knotAt(a, edge[e]), q = w.knotAt(a, edge[(e + 1) % 3]);
      for (const auto& t : w.contactTriangles(b)) {
        const std::uint32_t low = std::min(edge[e], t[0]), high = std::max(edge[e], t[0]);
        if (low < from || (a == b && high - low <= apart)) continue;
        count += pierces(p, q, {w.knotAt(b, t[0]), w.knotAt(b, t[1]), w.knotAt(b, t[2])});
      }
    }
  }
  return count;
}

/// Steady forces on knots, from now on.
void pull(scene::StepInput& in, std::uint16_t object, std::uint32_t first, std::uint32_t count,
          const Vector3d& force) {
  in.load_over = 0.05;
  for (std::uint32_t k = first; k < first + count; ++k) {
    scene::KnotLoad load;
    load.object = object, load.knot = k;
    for (int e = 0; e < 3; ++e) load.force[e] = static_cast<float>(force[e] / count);
    in.loads.push_back(load);
  }
}

void run(scene::World& w, scene::StepInput& in, int steps) {
  scene::StepReport report;
  for (int i = 0; i < steps; ++i) {
    ASSERT_NE(w.step(in, report), scene::Status::Fault);
    in.loads.clear(), in.impacts.clear(), in.load_over = 0.0;
  }
}

TEST(SelfContact, ATubeThatIsFoldedByItsEndDoesNotPassThroughItself) {
  std::uint64_t hash = 0;
  for (const int threads : {1, 3}) {
    scene::World w(sceneOf({loop(true)}), threads);
    scene::StepInput in;
    const auto end = static_cast<std::uint32_t>(w.knotCount(0)) - 6;
    pull(in, 0, end, 6, Vector3d(0, -0.003, 0));
    int most = 0;
    for (int i = 0; i < 8; ++i) {
      run(w, in, 100);
      most = std::max(most, piercings(w, 0, 0, 48));
    }
    EXPECT_EQ(most, 0);
    EXPECT_LT(w.knotAt(0, end).y(), 0.0) << "it was pulled over the other limb, and slid round it";
    if (hash != 0) {
      EXPECT_EQ(w.stateHash(), hash) << "whatever the number of threads";
    }
    hash = w.stateHash();
    std::vector<std::uint8_t> bytes;
    w.save(bytes);
    scene::World other(sceneOf({loop(true)}));
    other.restore(bytes);
    run(w, in, 50), run(other, in, 50);
    EXPECT_EQ(w.stateHash(), other.stateHash()) << "a snapshot knows the sides";
  }
}

/// @param beside numbers of knots that differ by less are neighbours; @param give of what the limbs exchange
void throwLimbs(const scene::Object& folded, std::uint32_t beside, double give) {
  scene::World w(sceneOf({folded}));
  scene::StepInput in;
  for (std::uint32_t t = 0; t < w.contactTriangles(0).size(); ++t) {
    const bool second = t > w.contactTriangles(0).size() / 2;
    in.impacts.push_back({0, t, {1 / 3.0, 1 / 3.0, 1 / 3.0}, Vector3d(0, second ? -5e-6 : 5e-6, 1e-6)});
  }
  run(w, in, 1);
  const auto momentum = [&] {
    Vector3d sum = Vector3d::Zero();
    std::vector<float> v(3 * w.knotCount(0));
    w.velocities(0, v.data());
    for (std::size_t k = 0; k < w.knotCount(0); ++k)
      sum += w.description().objects[0].mass[k] * Vector3d(v[3 * k], v[3 * k + 1], v[3 * k + 2]);
    return sum;
  };
  const auto energy = [&] { return w.energy().kinetic; };
  const auto spin = [&] {
    Vector3d sum = Vector3d::Zero();
    std::vector<float> v(3 * w.knotCount(0));
    w.velocities(0, v.data());
    for (std::size_t k = 0; k < w.knotCount(0); ++k)
      sum += w.description().objects[0].mass[k] *
             w.knotAt(0, k).cross(Vector3d(v[3 * k], v[3 * k + 1], v[3 * k + 2]));
    return sum;
  };
  const Vector3d start = momentum(), spin_at_start = spin();
  // What the limbs exchange: 5e-6 N·s on each triangle of one, at 2·kRadius from the other.
  const double exchanged = 2.5e-6 * static_cast<double>(w.contactTriangles(0).size()) * 2 * kRadius;
  const double at_start = energy();
  std::size_t touching = 0;
  for (int i = 0; i < 600; ++i) {
    run(w, in, 1);
    for (const auto& pair : w.state().pairs) touching += pair.object == pair.other;
    ASSERT_LE(energy(), at_start * 1.01);
  }
  EXPECT_GT(touching, 1000u);
  EXPECT_EQ(piercings(w, 0, 0, beside), 0);
  EXPECT_LT((momentum() - start).norm(), 1e-5 * start.norm());
  EXPECT_LT((spin() - spin_at_start).norm(), give * exchanged)
      << "friction acts at both sides of a thickness";
}

TEST(SelfContact, LimbsThrownAtEachOtherKeepMomentumAndFeedNothing) {
  throwLimbs(loop(false), 48, 1e-3);
  // Backward Euler alone, without contacts, loses 1.7 % of that spin.
  throwLimbs(bar(false, fem::Strain::Corotational), 8 * kSlice, 2e-2);
}

struct Elements {
  fem::Strain strain;
  fem::Motion motion;
  double force;  // N, on the end: bends it by far more than the 16 mm that are there
};
class OfElements : public testing::TestWithParam<Elements> {};

TEST_P(OfElements, ABarThatIsFoldedByItsEndDoesNotPassThroughItself) {
  const Elements& e = GetParam();
  std::uint64_t hash = 0;
  for (const int threads : {1, 3}) {
    scene::World w(sceneOf({bar(true, e.strain, e.motion)}), threads);
    scene::StepInput in;
    const auto end = static_cast<std::uint32_t>(w.knotCount(0)) - kSlice;
    pull(in, 0, end, kSlice, Vector3d(0, -e.force, 0));
    int most = 0;
    double lowest = 1.0;
    for (int i = 0; i < 12; ++i) {
      run(w, in, 50);
      most = std::max(most, piercings(w, 0, 0, 8 * kSlice));
      lowest = std::min(lowest, w.knotAt(0, end).y());
    }
    EXPECT_EQ(most, 0);
    EXPECT_LT(lowest, 0.0115)
        << "its outer side was pulled onto the other limb, which is at 10 mm, from 19 mm";
    if (hash != 0) {
      EXPECT_EQ(w.stateHash(), hash) << "whatever the number of threads";
    }
    hash = w.stateHash();
  }
}
INSTANTIATE_TEST_SUITE_P(SelfContact, OfElements,
                         testing::Values(Elements{fem::Strain::Corotational, fem::Motion::BackwardEuler,
                                                  0.02},
                                         Elements{fem::Strain::Small, fem::Motion::BackwardEuler, 0.05},
                                         Elements{fem::Strain::Small, fem::Motion::Elastostatic, 5e-4}));

/// A thin tube along x or y, with long triangles.
scene::Object straw(const char* name, bool across, double z, bool held) {
  specimen::TubeOptions o;
  o.name = name, o.rings = 9, o.around = 3, o.radius = 0.001, o.length = 0.08, o.mass = 0.001;
  o.youngs_modulus = 100e3, o.knot_damping = held ? 2e-3 : 0.0;
  o.fix_ends = held, o.centre = Vector3d(0.005, 0, z);
  scene::Object t = specimen::tube(o);
  if (!across) return t;
  for (auto* p : {&t.position, &t.rest_position})
    for (Vector3d& x : *p) x = Vector3d(-x.y(), x.x(), x.z());  // a turn by 90 degrees
  return t;
}

TEST(EdgeContact, WhatIsThinDoesNotPassBetweenTheKnotsOfWhatIsThin) {
  scene::World w(sceneOf({straw("below", false, 0.0, true), straw("above", true, 0.008, false)}));
  scene::StepInput in;
  pull(in, 1, 0, 27, Vector3d(0, 0, -0.001));
  run(w, in, 400);
  EXPECT_EQ(piercings(w, 0, 1) + piercings(w, 1, 0), 0);
  double middle = 0;
  for (std::uint32_t k = 12; k < 15; ++k) middle += w.knotAt(1, k).z() / 3;
  EXPECT_GT(middle, -0.03) << "it lies on the other one; it would have fallen by 0.08 m";
}

TEST(TogetherByDesign, OrgansThatTouchAtTheStartCollideElsewhere) {
  // Two tubes along x that touch at their left ends and diverge.
  specimen::TubeOptions o;
  o.rings = 24, o.around = 6, o.radius = 0.003, o.length = 0.12, o.mass = 0.004;
  o.youngs_modulus = 20e3, o.knot_damping = 1e-3, o.fix_ends = false, o.centre = Vector3d(0.06, 0, 0);
  o.name = "lower";
  scene::Object lower = specimen::tube(o);
  o.name = "upper";
  scene::Object upper = specimen::tube(o);
  for (auto* p : {&upper.position, &upper.rest_position})
    for (Vector3d& x : *p)  // turned by about 8.5 degrees
      x = Vector3d(0.989 * x.x() - 0.148 * x.y(), 0.0066 + 0.989 * x.y() + 0.148 * x.x(), x.z());
  for (scene::Index k = 0; k < 18; ++k) lower.fixed[k] = upper.fixed[k] = 1;
  for (scene::Index k = 126; k < 144; ++k) lower.fixed[k] = 1;
  scene::World w(sceneOf({lower, upper}));
  scene::StepInput in;
  scene::StepReport report;
  run(w, in, 200);
  EXPECT_LT((w.knotAt(1, 60) - upper.position[60]).norm(), 1e-5) << "at rest where they touch";
  pull(in, 1, 138, 6, Vector3d(0, -0.004, 0));
  int most = 0;
  for (int i = 0; i < 12; ++i) {
    run(w, in, 50);
    most = std::max(most, piercings(w, 0, 1, 0, 84) + piercings(w, 1, 0, 0, 84));
    if (i == 3) {
      EXPECT_NEAR(w.knotAt(1, 138).y(), 0.0095, 0.0015) << "it lies on the lower one, before it slides off";
    }
  }
  EXPECT_EQ(most, 0) << "beyond what touched";
}

}  // namespace

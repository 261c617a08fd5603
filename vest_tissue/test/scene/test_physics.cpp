#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "nets.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// Knots in a row along x with linear springs.
scene::Description chain(int knots, double spacing, double mass, double k, const Vector3d& gravity) {
  scene::Description d;
  d.name = "chain";
  d.gravity = gravity;
  scene::Object o;
  o.name = "chain";
  for (int i = 0; i < knots; ++i) {
    o.rest_position.emplace_back(spacing * i, 0, 0);
    o.mass.push_back(mass);
    o.damping.push_back(0.0);
    o.fixed.push_back(0);
    if (i == 0) continue;
    scene::Link l;
    l.knot0 = i - 1, l.knot1 = i, l.rest = spacing, l.stiffness = k;
    o.links.push_back(l);
  }
  o.position = o.rest_position;
  d.objects.push_back(o);
  return d;
}

Vector3d at(const scene::World& w, std::size_t object, std::size_t knot) {
  std::vector<float> p(3 * w.knotCount(object));
  w.positions(object, p.data());
  return {p[3 * knot], p[3 * knot + 1], p[3 * knot + 2]};
}

TEST(Physics, ASpringOscillatesWithTheFrequencyOfTheory) {
  auto d = chain(2, 0.02, 1e-3, 10.0, Vector3d::Zero());
  d.objects[0].fixed[0] = 1;
  d.objects[0].position[1].x() = 0.022;
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  double last = 0.002, first_crossing = -1, crossings = 0, last_crossing = 0;
  for (int i = 1; i <= 1000; ++i) {
    w.step(in, report);
    const double x = at(w, 0, 1).x() - 0.02;
    if (last > 0 && x <= 0) {
      const double t = 1e-3 * (i - 1 + last / (last - x));
      if (first_crossing < 0)
        first_crossing = t;
      else
        ++crossings;
      last_crossing = t;
    }
    last = x;
  }
  const double period = (last_crossing - first_crossing) / crossings;
  EXPECT_NEAR(period, 2 * M_PI / std::sqrt(10.0 / 1e-3), 0.005 * 0.0628);
}

TEST(Physics, AHangingChainStretchesByTheWeightBelowEachLink) {
  auto d = chain(6, 0.01, 1e-3, 20.0, Vector3d(9.81, 0, 0));  // hangs along x
  d.objects[0].fixed[0] = 1;
  for (double& g : d.objects[0].damping) g = 0.02;
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  for (int i = 0; i < 4000; ++i) w.step(in, report);
  for (int i = 1; i < 6; ++i) {
    const double stretch = (at(w, 0, i) - at(w, 0, i - 1)).x() - 0.01;
    EXPECT_NEAR(stretch, (6 - i) * 1e-3 * 9.81 / 20.0, 5e-6) << "link " << i;
  }
  EXPECT_NEAR(w.reaction(0).x(), -6e-3 * 9.81, 1e-4) << "the fixed knot carries the chain and itself";
}

TEST(Physics, StressAtAKnotIsTheLawOfItsMostStretchedLink) {
  specimen::TubeOptions o;
  o.a2 = 3.0;
  scene::Description d;
  d.objects.push_back(specimen::tube(o));
  for (Vector3d& p : d.objects[0].position) p.x() *= 1.2;
  const scene::World w(d);
  std::vector<float> strain(w.knotCount(0)), stress(w.knotCount(0));
  w.strain(0, strain.data());
  w.field(0, scene::Field::Stress, stress.data());
  for (std::size_t k = 0; k < stress.size(); ++k) {
    EXPECT_NEAR(strain[k], 0.2, 1e-5);
    EXPECT_NEAR(stress[k], 20e3 * 0.2 * (1 + 3 * 0.2), 1.0) << "knot " << k;
  }
}

TEST(Physics, MomentumIsConservedByInnerForces) {
  specimen::TubeOptions o;
  o.fix_ends = false;
  o.knot_damping = 0.0;
  auto d = specimen::tubeScene(o);
  d.gravity.setZero();
  for (std::size_t i = 0; i < d.objects[0].position.size(); ++i)
    d.objects[0].position[i].x() *= 1.0 + 0.1 * std::sin(0.3 * i);
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  std::vector<float> v(3 * w.knotCount(0));
  for (int i = 0; i < 300; ++i) w.step(in, report);
  w.velocities(0, v.data());
  Vector3d p = Vector3d::Zero();
  double size = 0;
  for (std::size_t i = 0; i < d.objects[0].mass.size(); ++i) {
    const Vector3d u(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    p += d.objects[0].mass[i] * u;
    size += d.objects[0].mass[i] * u.norm();
  }
  ASSERT_GT(size, 0.0);
  EXPECT_LT(p.norm(), 1e-4 * 0.004);
}

TEST(Physics, WithoutDampingEnergyDoesNotGrow) {
  specimen::TubeOptions o;
  o.damping = 0.0, o.knot_damping = 0.0;
  auto d = specimen::tubeScene(o);
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  const auto total = [&] {
    const auto e = w.energy();
    return e.kinetic + e.elastic + e.potential;
  };
  const double start = total();
  double most = 0, swing = 0;
  for (int i = 0; i < 5000; ++i) {
    w.step(in, report);
    if (i % 10) continue;
    most = std::max(most, std::fabs(total() - start));
    swing = std::max(swing, w.energy().kinetic);
  }
  EXPECT_LT(most, 0.05 * swing);
}

TEST(Physics, EveryStiffnessIsStableExplicitlyOrImplicitly) {
  int implicit = 0;
  for (int power = 0; power <= 12; ++power) {
    specimen::TubeOptions o;
    o.youngs_modulus = 20e3 * std::pow(10.0, power);
    scene::World w(specimen::tubeScene(o));
    scene::StepInput in;
    scene::StepReport report;
    for (int i = 0; i < 100; ++i) ASSERT_EQ(w.step(in, report), scene::Status::Ok) << "10^" << power;
    implicit += w.model().objects[0].implicit;
  }
  EXPECT_GE(implicit, 8);
  EXPECT_LE(implicit, 11) << "soft nets keep their explicit sub-steps";
}

TEST(Physics, AVanishingMassMovesWithItsNeighbours) {
  auto d = specimen::tubeScene();
  d.objects[0].mass[17] = 1e-14;
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  for (int i = 0; i < 200; ++i) ASSERT_EQ(w.step(in, report), scene::Status::Ok);
  double spacing = (at(w, 0, 17) - at(w, 0, 16)).norm();
  EXPECT_NEAR(spacing, (d.objects[0].rest_position[17] - d.objects[0].rest_position[16]).norm(), 5e-4);
}

TEST(Physics, AKnotDoesNotFallThroughTheCavity) {
  auto d = chain(3, 0.01, 1e-3, 20.0, Vector3d(0, 0, -9.81));
  for (auto& p : d.objects[0].position) p.z() = 0.05;
  d.objects[0].rest_position = d.objects[0].position;
  scene::Object floor;
  floor.name = "floor";
  floor.model = scene::ObjectModel::Rigid;
  floor.position = {{-0.1, -0.1, 0}, {0.1, -0.1, 0}, {0.1, 0.1, 0}, {-0.1, 0.1, 0}};
  floor.contact_triangles = {{0, 1, 2}, {0, 2, 3}};
  d.objects.push_back(floor);
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(w.step(in, report), scene::Status::Ok);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(at(w, 0, i).z(), d.objects[0].contact_thickness, 0.0005);
}

}  // namespace

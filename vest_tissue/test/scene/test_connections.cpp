#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "blades.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

// Protects what ties objects together: connections keep momentum and angular momentum, blades that sever them
// say so, the number of objects has no limit, and a part that nothing holds any more falls.

namespace {

using namespace vest;
using Eigen::Vector3d;

/// kg·m/s, kg·m²/s: of all knots, about the origin.
struct Motion {
  Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();
};

Motion motionOf(const scene::World& w) {
  Motion m;
  for (std::size_t i = 0; i < w.objectCount(); ++i) {
    std::vector<float> v(3 * w.knotCount(i));
    w.velocities(i, v.data());
    for (std::size_t k = 0; k < w.knotCount(i); ++k) {
      const double mass = w.state().objects[i].block.row(net::Block::kMass)[k];
      const Vector3d p = mass * Vector3d(v[3 * k], v[3 * k + 1], v[3 * k + 2]);
      m.linear += p, m.angular += w.knotAt(i, k).cross(p);
    }
  }
  return m;
}

/// Two tubes in free flight, held at a distance by connections.
scene::Description twins() {
  scene::Description d;
  d.name = "twins", d.gravity.setZero();
  for (int i = 0; i < 2; ++i) {
    specimen::TubeOptions o;
    o.name = i == 0 ? "one" : "other";
    o.fix_ends = false, o.knot_damping = 0.0;
    o.centre = Vector3d(0, 0.016 * i, 0);
    d.objects.push_back(specimen::tube(o));
  }
  for (const scene::Index ring : {4u, 8u, 12u}) {
    scene::Connection c;
    c.object0 = "one", c.object1 = "other";
    c.knot0 = 8 * ring;                                         // towards +y, where the other is
    c.triangle1 = {8 * ring + 4, 8 * ring + 12, 8 * ring + 5};  // its side towards -y
    c.weights1 = {0.5, 0.25, 0.25};
    c.offset = d.objects[0].position[c.knot0];
    for (std::size_t k = 0; k < 3; ++k) c.offset -= c.weights1[k] * d.objects[1].position[c.triangle1[k]];
    c.stiffness = 20, c.damping = 0.005;
    d.connections.push_back(c);
  }
  return d;
}

TEST(Connections, TwoFreeBodiesKeepMomentumAndAngularMomentum) {
  scene::World w(twins());
  scene::StepInput in;
  scene::StepReport report;
  for (int axis = 0; axis < 3; ++axis) {  // it tumbles about all three
    scene::ImpactInput hit;
    hit.object = static_cast<std::uint16_t>(axis % 2), hit.triangle = static_cast<std::uint32_t>(40 * axis);
    hit.weights = {0.4, 0.3, 0.3};
    hit.momentum[axis] = 3e-4;
    in.impacts.push_back(hit);
  }
  ASSERT_EQ(w.step(in, report), scene::Status::Ok);
  in.impacts.clear();
  const Motion start = motionOf(w);
  ASSERT_GT(start.angular.norm(), 1e-6);
  double lost = 0, turned = 0;
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(w.step(in, report), scene::Status::Ok);
    const Motion now = motionOf(w);
    lost = std::max(lost, (now.linear - start.linear).norm() / start.linear.norm());
    turned = std::max(turned, (now.angular - start.angular).norm() / start.angular.norm());
  }
  std::printf("momentum within %.1e, angular momentum within %.1e\n", lost, turned);
  EXPECT_LT(lost, 3e-6);
  EXPECT_LT(turned, 3.5e-4);
}

TEST(Connections, ABladeThatSeversOneSaysSo) {
  scene::Description d = twins();
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  std::size_t told = 0;
  // A hook under current, between the two tubes, along all three connections.
  for (int i = 0; i <= 400; ++i) {
    in.tools[1] =
        specimen::toolAt(tools::ToolKind::CoagulationHook, Vector3d(-0.05 + 0.00025 * i, 0.008, 0.007),
                         Vector3d(0, 0, -1), Vector3d(1, 0, 0));
    in.tools[1].functions = tools::kFunctionCut;
    ASSERT_NE(w.step(in, report), scene::Status::Fault);
    for (const scene::Event& e : report.events) {
      if (e.kind != scene::EventKind::Cut) continue;
      EXPECT_EQ(e.instrument, 1);
      EXPECT_EQ(e.object, 0);
      ++told;
    }
  }
  std::size_t left = 0;
  for (const auto& c : w.state().connections) left += c.alive;
  EXPECT_LT(left, d.connections.size());
  EXPECT_EQ(told, d.connections.size() - left);
}

TEST(ManyObjects, TheLastOfTwoHundredCollideAndAreHeld) {
  scene::Description d;
  d.name = "many";
  for (int i = 0; i < 200; ++i) {
    specimen::TubeOptions o;
    o.name = "tube_" + std::to_string(i);
    const bool last = i >= 198;
    o.rings = last ? 16 : 3, o.around = last ? 8 : 3, o.length = last ? 0.06 : 0.01;
    o.centre = last ? Vector3d(0, 0, i == 198 ? 0.05 : 0.062)
                    : Vector3d(1.0 + 0.05 * (i % 20), 0.05 * (i / 20), 0.05);
    o.mass = last ? 0.001 : 3e-4;
    o.youngs_modulus = 200e3, o.knot_damping = 1e-3;
    o.fix_ends = i != 199;
    d.objects.push_back(specimen::tube(o));
  }
  for (auto* p : {&d.objects[199].position, &d.objects[199].rest_position})
    for (Vector3d& x : *p) std::swap(x.x(), x.y());  // across the other
  for (auto& t : d.objects[199].contact_triangles) std::swap(t[1], t[2]);
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  const auto height = [&](std::size_t object = 199) {  // m: of its middle rings
    double sum = 0;
    for (std::size_t k = 56; k < 72; ++k) sum += w.knotAt(object, k).z() / 16.0;
    return sum;
  };
  for (int i = 0; i < 250; ++i) ASSERT_NE(w.step(in, report), scene::Status::Fault);
  EXPECT_GT(height(), height(198) + 0.003) << "it lies on the one below; in free fall it would be at -0.24";
  // What jaws hold they do not push: closed on it, they lift it.
  const Vector3d end = w.knotAt(199, 64);
  std::size_t grasped = 0;
  for (int i = 0; i < 500; ++i) {
    const double lift = 0.04 * std::max(0.0, (i - 250) / 250.0);
    in.tools[1] = specimen::toolAt(tools::ToolKind::Grasper, Vector3d(end.x(), 0.02, end.z() + lift - 0.004),
                                   Vector3d(0, 0, -1), Vector3d(1, 0, 0), std::max(0.1, 1.0 - i / 200.0));
    ASSERT_NE(w.step(in, report), scene::Status::Fault);
    for (const auto& e : report.events) grasped += e.kind == scene::EventKind::Grasped && e.object == 199;
  }
  EXPECT_EQ(grasped, 1u);
  EXPECT_GT(height(), 0.07) << "lifted";
}

/// A bar held at both ends whose surroundings carry every knot in its place (`support`).
scene::Description supported() {
  specimen::BarOptions o;
  o.rows = 3, o.spacing = 0.003, o.thickness = 0.003, o.mass = 0.003;
  auto d = specimen::barScene(o);
  scene::Object& b = d.objects[0];
  for (scene::Index k = 0; k < b.position.size(); ++k) {
    if (b.fixed[k]) continue;
    const double omega = 40, stiffness = b.mass[k] * omega * omega;
    b.tethers.push_back(
        {k, b.position[k] + Vector3d(0, 0, 9.81 / (omega * omega)), stiffness, 1.4 * omega * b.mass[k]});
  }
  return d;
}

TEST(Support, APartThatNothingHoldsFalls) {
  scene::World w(supported());
  scene::StepInput in;
  scene::StepReport report;
  const auto scissors = [&](double x) {
    for (int i = 0; i <= 210; ++i) {
      const double in_y = i < 60 ? 0.02 * (1.0 - i / 60.0) : 0.0,
                   jaw = i < 60 ? 0.9 : 0.9 * (1 - (i - 60) / 150.0);
      in.tools[1] = specimen::toolAt(tools::ToolKind::Scissors, Vector3d(x, 0.0095 - in_y, 0.05),
                                     Vector3d(0, 1, 0), Vector3d(0, 0, 1), jaw);
      ASSERT_NE(w.step(in, report), scene::Status::Fault);
    }
    in.tools[1].present = false;
    for (int i = 0; i < 100; ++i) ASSERT_NE(w.step(in, report), scene::Status::Fault);
  };
  const auto middle = w.description().objects[0].position.size() / 4;  // of the lower layer
  for (int i = 0; i < 500; ++i) w.step(in, report);
  EXPECT_NEAR(w.knotAt(0, middle).z(), 0.0485, 1e-3) << "carried";
  scissors(0.0085);
  EXPECT_NEAR(w.knotAt(0, middle).z(), 0.0485, 2e-3) << "it still hangs on one end";
  scissors(-0.0085);
  for (int i = 0; i < 200; ++i) ASSERT_NE(w.step(in, report), scene::Status::Fault);
  EXPECT_LT(w.knotAt(0, middle).z(), -0.05) << "cut out: 0.3 s of free fall";
  EXPECT_NEAR(w.knotAt(0, 1).z(), 0.0485, 3e-3) << "what hangs on its end stays";
  // A snapshot knows what fell.
  std::vector<std::uint8_t> bytes;
  w.save(bytes);
  scene::World other(supported());
  other.restore(bytes);
  for (int i = 0; i < 50; ++i) w.step(in, report), other.step(in, report);
  EXPECT_EQ(w.stateHash(), other.stateHash());
}

TEST(Support, WhatNeverHungOnAnythingStays) {
  scene::Description d = supported();
  std::fill(d.objects[0].fixed.begin(), d.objects[0].fixed.end(), std::uint8_t{0});
  scene::World w(d);
  const auto z = w.knotAt(0, 20).z();
  scene::StepReport report;
  ASSERT_TRUE(w.removeLink(0, 3));
  for (int i = 0; i < 500; ++i) ASSERT_EQ(w.step({}, report), scene::Status::Ok);
  EXPECT_NEAR(w.knotAt(0, 20).z(), z, 3e-3) << "a nick does not drop a whole organ";
}

}  // namespace

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../../src/cli/settle.h"
#include "nets.h"
#include "vest_tissue/scene/world.h"

// Protects that a scene which came to rest is at rest in the next World that is made of it
// (docs/decisions/0022).

namespace {

using namespace vest;
using Eigen::Vector3d;

/// m/s: of the fastest knot within the first steps of a World.
double fastestAtStart(const scene::Description& d, int steps) {
  scene::World world(d);
  return tools::run(world, 1e-3 * steps, 0.0).speed;
}

/// A rigid block whose top is at z = 0.
scene::Object block() {
  scene::Object o;
  o.name = "block";
  o.model = scene::ObjectModel::Rigid;
  for (int i = 0; i < 8; ++i)
    o.position.emplace_back(i & 1 ? 0.1 : -0.1, i & 2 ? 0.03 : -0.03, i & 4 ? 0.0 : -0.02);
  o.rest_position = o.position;
  o.mass.assign(8, 1.0), o.damping.assign(8, 0.0), o.fixed.assign(8, 1);
  o.contact_triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                         {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return o;
}

TEST(Resting, ATubeThatLiesOnABlockLiesThereInTheNextWorld) {
  specimen::TubeOptions options;
  options.fix_ends = false;
  options.centre = Vector3d(0, 0, 0.0047);
  scene::Description d = specimen::tubeScene(options);
  d.objects.push_back(block());
  {
    scene::World world(d);
    tools::run(world, 3.0, 3.0);
    tools::readPositions(world, d);
  }
  const auto lowest = [&] {
    double z = 1.0;
    for (const auto& x : d.objects[0].position) z = std::min(z, x.z());
    return z;
  };
  const double before = lowest();
  scene::World world(d);
  const double speed = tools::run(world, 1.0, 0.0).speed;
  tools::readPositions(world, d);
  std::printf("lies at %.4f mm, sinks by %.4f mm, %.2f mm/s\n", 1e3 * before, 1e3 * (before - lowest()),
              1e3 * speed);
  EXPECT_LT(speed, 0.001) << "m/s";
  EXPECT_NEAR(lowest(), before, 1e-5) << "m: it sank by 0.1 mm";
}

TEST(Resting, AConnectionsOffsetTurnsWithTheOrganThatCarriesIt) {
  specimen::TubeOptions options;
  options.fix_ends = false;
  options.length = 0.05, options.youngs_modulus = 60e3, options.knot_damping = 1e-3;
  scene::Description d = specimen::tubeScene(options);
  for (std::size_t k = 0; k < 16; ++k) d.objects[0].fixed[k] = 1;  // held at one end: it hangs down
  options.name = "weight";
  options.rings = 4, options.length = 0.01, options.mass = 0.001;
  options.centre = Vector3d(0.02, 0.015, 0.05);
  d.objects.push_back(specimen::tube(options));
  const auto& carrier = d.objects[0];
  for (scene::Index k = 0; k < 32; k += 4) {
    scene::Connection c;
    c.object0 = "weight", c.object1 = "tube";
    c.knot0 = k;
    c.triangle1 = carrier.contact_triangles[2 * 8 * 11 + k / 2];
    c.weights1 = {1 / 3.0, 1 / 3.0, 1 / 3.0};
    Vector3d foot = Vector3d::Zero();
    for (const auto n : c.triangle1) foot += carrier.rest_position[n] / 3.0;
    c.offset = d.objects[1].rest_position[k] - foot;
    c.stiffness = 5.0, c.damping = 0.01;
    d.connections.push_back(c);
  }
  const Vector3d drawn = d.connections[0].offset;
  tools::settle(d, 60.0, 1, false);
  const Vector3d turned = d.connections[0].offset;
  const double angle = std::acos(std::clamp(drawn.normalized().dot(turned.normalized()), -1.0, 1.0));
  const double speed = fastestAtStart(d, 2000);
  std::printf("turned by %.1f degrees; %.3f mm/s\n", angle * 57.3, 1e3 * speed);
  EXPECT_GT(angle, 0.05) << "rad: else this test says nothing";
  EXPECT_LT(speed, 0.001) << "m/s, from the first step on";
  tools::startAtRest(d);
  EXPECT_LT((d.connections[0].offset - drawn).norm(), 1e-12) << "m: as it was drawn";
}

}  // namespace

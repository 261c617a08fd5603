#include <gtest/gtest.h>

#include <string>

#include "temporary_scene.h"
#include "vest_tissue/scene/world.h"

namespace {

using vest::scene::Connection;
using vest::scene::loadScene;

/// Two squares of four knots, one 2 mm above the other and shifted by half of its width.
struct Squares {
  vest::test::TemporaryScene scene;
  Squares() {
    scene.write("low.csv", "node,x,y,z\n0,0,0,0\n1,0.01,0,0\n2,0.01,0.01,0\n3,0,0.01,0\n");
    scene.write("high.csv",
                "node,x,y,z\n0,0.005,0,0.002\n1,0.015,0,0.002\n2,0.015,0.01,0.002\n3,0.005,0.01,0.002\n");
    scene.write("links.csv", "n0,n1\n0,1\n1,2\n2,3\n3,0\n0,2\n");
    scene.write("triangles.csv", "n0,n1,n2\n0,1,2\n0,2,3\n");
    scene.write("fixed.csv", "node\n0\n1\n2\n3\n");
  }
  std::string file(const std::string& more, const std::string& of_high = "") {
    const std::string material = "material: {youngs_modulus: 10000}, knot_mass: 0.001, link_area: 1e-6";
    return scene.write(
        "scene.yaml",
        "gravity: [0, 0, 0]\nobjects:\n"
        "  - {name: low, nodes: low.csv, links: links.csv, triangles: triangles.csv, fixed: fixed.csv, " +
            material + "}\n  - {name: high, nodes: high.csv, links: links.csv, triangles: triangles.csv, " +
            material + of_high + "}\n" + more);
  }
};

TEST(Connect, TiesEachKnotToTheNearestPlaceWithinReach) {
  Squares s;
  const auto d =
      loadScene(s.file("connect:\n  - {objects: [high, low], within: 0.0021, stiffness: 5, damping: 0.01, "
                       "break_force: 0.2}\n"));
  ASSERT_EQ(d.connections.size(), 2u) << "knots 1 and 2 hang over the edge";
  for (const Connection& c : d.connections) {
    EXPECT_EQ(c.object0, "high");
    EXPECT_EQ(c.object1, "low");
    EXPECT_TRUE(c.knot0 == 0 || c.knot0 == 3);
    EXPECT_NEAR(c.weights1[0] + c.weights1[1] + c.weights1[2], 1.0, 1e-9);
    EXPECT_NEAR(c.offset.x(), 0.0, 1e-9);
    EXPECT_NEAR(c.offset.z(), 0.002, 1e-9);
    EXPECT_EQ(c.stiffness, 5.0);
    EXPECT_EQ(c.damping, 0.01);
    EXPECT_EQ(c.break_force, 0.2);
  }
  EXPECT_EQ(loadScene(s.file("connect:\n  - {objects: [high, low], within: 0.01, stiffness: 5, most: 3}\n"))
                .connections.size(),
            3u);
}

TEST(Connect, HoldsUpToItsStrengthThenTearsWithAnEvent) {
  Squares s;
  const auto d =
      loadScene(s.file("connect:\n  - {objects: [high, low], within: 0.0021, stiffness: 5, damping: 0.01, "
                       "break_force: 0.01}\n"));
  for (const double gravity : {2.0, 20.0}) {  // four grams on two ties: 4 mN, 40 mN each
    vest::scene::World w(d);
    vest::scene::StepInput input;
    vest::scene::StepReport report;
    input.edits.push_back({"", "gravity_z", gravity});
    int torn = 0;
    for (int i = 0; i < 1500; ++i) {
      w.step(input, report);
      input.edits.clear();
      for (const auto& e : report.events) {
        if (e.kind != vest::scene::EventKind::Torn) continue;
        ++torn;
        EXPECT_GT(e.force, 0.01);
      }
    }
    EXPECT_EQ(torn, gravity < 10.0 ? 0 : 2);
  }
}

TEST(Connect, RefusesByNameWhatCannotBe) {
  Squares s;
  const auto refused = [&](const std::string& more, const std::string& word,
                           const std::string& of_high = "") {
    try {
      loadScene(s.file(more, of_high));
      FAIL() << more;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    }
  };
  refused("connect:\n  - {objects: [high, spleen], within: 0.01, stiffness: 5}\n", "spleen");
  refused("connect:\n  - {objects: [high, high], within: 0.01, stiffness: 5}\n", "another");
  refused("connect:\n  - {objects: [high, low], within: 0.001, stiffness: 5}\n", "within");
  refused("connect:\n  - {objects: [high, low], within: 0.01}\n", "stiffness");
  refused("connect:\n  - {objects: [high, low], within: 0.01, stiffness: 5, colour: red}\n", "colour");
  refused("", "heart", ", motility: {preset: heart}");
  refused("", "speed", ", motility: {radial: {speed: 3}}");
  refused("", "conductivity", ", thermal: {conductivity: -1}");
  refused("", "grasp_damage_threshold", ", grasp_damage_threshold: -3");
}

TEST(Connect, ReadsWhatMakesAnObjectLive) {
  Squares s;
  const auto d =
      loadScene(s.file("",
                       ", thermal: {heat_capacity: 3000, conductivity: 0.4, perfusion: 0.01, water: 0.7}"
                       ", grasp_damage_threshold: 2e5, motility: {preset: colon, ramp: 2, "
                       "radial: {pressure: 33, direction: -1}}"));
  const auto& o = d.objects[1];
  EXPECT_EQ(o.thermal.heat_capacity, 3000.0);
  EXPECT_EQ(o.thermal.conductivity, 0.4);
  EXPECT_EQ(o.thermal.perfusion, 0.01);
  EXPECT_EQ(o.thermal.water, 0.7);
  EXPECT_EQ(o.grasp_damage_threshold, 2e5);
  EXPECT_EQ(o.motility.ramp, 2.0);
  EXPECT_EQ(o.motility.waves[0].pressure, 33.0);
  EXPECT_EQ(o.motility.waves[0].direction, -1.0);
  EXPECT_EQ(o.motility.waves[0].frequency, 0.05) << "three a minute, from the preset";
  EXPECT_FALSE(d.objects[0].motility.active());
}

}  // namespace

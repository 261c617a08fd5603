#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

using namespace vest::modelling;

namespace {

const std::string kPackage = VEST_TISSUE_SOURCE_DIR;

std::string messageOf(const std::string& source) {
  char path[] = "/tmp/vest_source_XXXXXX";
  const int file = mkstemp(path);
  EXPECT_GE(file, 0);
  std::ofstream(path) << source;
  std::string message;
  try {
    bake(readSource(path), readMaterials(kPackage + "/data/materials.yaml"));
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  std::remove(path);
  return message;
}

std::string tube(const std::string& more) {
  return "vest_source: 1\nname: t\nobjects:\n  - name: a\n    organ: tube\n    material: tube\n"
         "    tube: {centre: [[0,0,0],[0.05,0,0]], reference: [0,0,1], rings: 10, around: 6, start_dome: "
         "0.002, end_dome: "
         "0.002, sections: [{at: 0, radii: [0.002]}]}\n" +
         more;
}

void expectSays(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "message was: " << message;
}

}  // namespace

TEST(Source, AGoodSourceBakes) {
  EXPECT_EQ(messageOf(tube("    springs: 180\n")), "");
}

TEST(Source, UnknownKeysAreNamedWithLine) {
  expectSays(messageOf(tube("    springs: 180\n    spings: 1\n")), ":9: objects[0].spings");
}

TEST(Source, AnImpossibleNumberOfSpringsNamesObjectAndRange) {
  expectSays(messageOf(tube("    springs: 17\n")),
             "object a: springs is 17, possible with these fillers is 180 to 180");
}

TEST(Source, AnUnknownMaterialIsNamed) {
  std::string source = tube("    springs: 180\n");
  source.replace(source.find("material: tube"), 14, "material: wood");
  expectSays(messageOf(source), "object a: material wood is not in the database");
}

TEST(Source, AConnectionThatReachesNothingIsAnError) {
  const std::string source =
      tube("    springs: 180\n    connect: [{to: b, rings: [0, 1], within: 0.001, stiffness: 1}]\n") +
      "  - {name: b, mirror_of: a, connect: [], tube: {centre: [[0,1,0],[0.05,1,0]], reference: [0,0,1], "
      "rings: 10, around: 6, start_dome: 0.002, end_dome: 0.002, sections: [{at: 0, radii: [0.002]}]}}\n";
  expectSays(messageOf(source), "object a: connect to b: no knot lies within");
}

TEST(Materials, TheShippedDatabaseLoadsAndIsPositive) {
  const auto materials = readMaterials(kPackage + "/data/materials.yaml");
  for (const char* name : {"uterus", "tube", "ovary", "ligament", "artery", "vein", "intestine", "liver"}) {
    ASSERT_EQ(materials.count(name), 1u) << name;
    EXPECT_GT(materials.at(name).law.youngs_modulus, 0);
    EXPECT_NEAR(materials.at(name).density, 1030, 60);
  }
}

// The nets beside a source are what the source says: nobody edited one without the other. Positions are left
// out, since settling moves them; everything else agrees within the rounding of libm between machines.
TEST(Bake, WhatIsShippedIsWhatTheSourceBakesTo) {
  const auto materials = readMaterials(kPackage + "/data/materials.yaml");
  for (const std::string scene : {"gynaecology", "slab", "tube"}) {
    const std::string folder = kPackage + "/scenes/" + scene;
    const auto baked = bake(readSource(folder + "/source.yaml"), materials);
    const auto shipped = vest::scene::loadScene(folder + "/" + scene + ".yaml");
    ASSERT_EQ(baked.objects.size(), shipped.objects.size());
    EXPECT_EQ(baked.connections.size(), shipped.connections.size());
    for (std::size_t o = 0; o < baked.objects.size(); ++o) {
      const auto &a = baked.objects[o], &b = shipped.objects[o];
      SCOPED_TRACE(a.name);
      EXPECT_EQ(a.name, b.name);
      ASSERT_EQ(a.mass.size(), b.mass.size());
      ASSERT_EQ(a.links.size(), b.links.size());
      EXPECT_EQ(a.fixed, b.fixed);
      EXPECT_EQ(a.skin.triangles, b.skin.triangles);
      EXPECT_EQ(a.skin.binding_knots, b.skin.binding_knots);
      EXPECT_EQ(a.contact_triangles, b.contact_triangles);
      EXPECT_NEAR(a.law.youngs_modulus, b.law.youngs_modulus, 1e-6 * a.law.youngs_modulus);
      for (std::size_t i = 0; i < a.mass.size(); ++i) {
        EXPECT_NEAR(a.mass[i], b.mass[i], 1e-6 * a.mass[i]);
        EXPECT_LT((a.rest_position[i] - b.rest_position[i]).norm(), 1e-7);
      }
      for (std::size_t i = 0; i < a.links.size(); ++i) {
        EXPECT_EQ(a.links[i].knot0, b.links[i].knot0);
        EXPECT_EQ(a.links[i].knot1, b.links[i].knot1);
        EXPECT_NEAR(a.links[i].rest, b.links[i].rest, 1e-6 * a.links[i].rest);
      }
    }
  }
}

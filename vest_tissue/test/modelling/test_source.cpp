#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "temporary_scene.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

using namespace vest::modelling;

namespace {

const std::string kPackage = VEST_TISSUE_SOURCE_DIR;

vest::scene::Description bakeText(const std::string& source, const std::string& part = "") {
  const vest::test::TemporaryScene folder;
  if (!part.empty()) folder.write("part.yaml", part);
  return bake(readSource(folder.write("source.yaml", source)),
              readMaterials(kPackage + "/data/materials.yaml"));
}

std::string messageOf(const std::string& source, const std::string& part = "") {
  try {
    bakeText(source, part);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
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

TEST(Source, ASkinOfGigabytesIsRefusedBeforeItIsMade) {
  std::string large = tube("    springs: 180\n    skin: {along: 16, around: 16}\n");
  large.replace(large.find("rings: 10"), 9, "rings: 1000");
  large.replace(large.find("around: 6"), 9, "around: 200");
  expectSays(messageOf(large), "source.yaml:");
  expectSays(messageOf(large), "object a: 51251200 vertices of skin");
}

TEST(Source, AnImpossibleNumberOfSpringsNamesLineObjectAndRange) {
  expectSays(messageOf(tube("    springs: 17\n")),
             "source.yaml:8: object a: springs is 17, possible with these fillers is 180 to 180");
}

TEST(Source, TheNumberOfSpringsIsFoundWhereItIsLeftOut) {
  const auto counted = bakeText(tube("    springs: 240\n    fillers: [ring2]\n"));
  for (const char* more : {"", "    fillers: [ring2]\n"}) {
    const auto found = bakeText(tube(more));
    ASSERT_EQ(found.objects[0].links.size(), 240u) << more;
    for (std::size_t i = 0; i < 240; ++i) {
      EXPECT_EQ(found.objects[0].links[i].knot0, counted.objects[0].links[i].knot0);
      EXPECT_EQ(found.objects[0].links[i].knot1, counted.objects[0].links[i].knot1);
    }
  }
  EXPECT_EQ(bakeText(tube("    fillers: []\n")).objects[0].links.size(), 180u);
  const auto sheet = bakeText(
      "vest_source: 1\nname: t\nobjects:\n  - name: a\n    organ: liver\n    material: liver\n    sheet: "
      "{stations: 5, height_knots: 4, thickness: 0.01, curves: "
      "[[[0,0,0],[0.05,0,0]],[[0,0.04,0],[0.05,0.04,0]]]}\n");
  // 5 rings of 8; 4 gaps of 8 along, 8 diagonal, 8 crossing; 2 leaf links a ring.
  EXPECT_EQ(sheet.objects[0].links.size(), 5u * 8 + 4 * 24 + 5 * 2);
}

/// Under tension as it lies: what is cut draws back.
TEST(Source, PrestrainShortensWhatLinksRestAt) {
  const auto description = bakeText(tube("    springs: 180\n    prestrain: 0.25\n"));
  const auto& object = description.objects.front();
  ASSERT_EQ(object.links.size(), 180u);
  for (const auto& link : object.links) {
    const double length = (object.rest_position[link.knot1] - object.rest_position[link.knot0]).norm();
    EXPECT_NEAR(length / link.rest, 1.25, 1e-9);
  }
  expectSays(messageOf(tube("    prestrain: 0.6\n")), "objects[0].prestrain");
}

TEST(Source, APartIsIncludedWhereItIsShiftedTo) {
  const auto scene = bakeText(tube("include: [{part: hollow, shift: [0, 0, -0.008]}]\n"));
  ASSERT_EQ(scene.objects.size(), 2u);
  const auto& cavity = scene.objects[1];
  EXPECT_EQ(cavity.name, "cavity");
  EXPECT_EQ(cavity.model, vest::scene::ObjectModel::Rigid);
  const auto shipped = vest::scene::loadScene(kPackage + "/scenes/fem_slab/fem_slab.yaml");
  for (const auto& object : shipped.objects) {
    if (object.name != "cavity") continue;
    ASSERT_EQ(object.rest_position.size(), cavity.rest_position.size());
    for (std::size_t i = 0; i < cavity.rest_position.size(); ++i)
      EXPECT_LT((object.rest_position[i] - cavity.rest_position[i]).norm(), 1e-7);
  }
}

TEST(Source, APartOfOnesOwnMayBeAllThereIs) {
  const std::string part = "vest_part: 1\n" + tube("").substr(tube("").find("objects:"));
  const auto scene = bakeText("vest_source: 1\nname: t\ninclude: [{file: part.yaml}]\n", part);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].name, "a");
  expectSays(messageOf(tube("include: [{file: part.yaml}]\n"), part),
             "part.yaml:3: objects[0].name: a: must be there once");
}

TEST(Source, MistakesInIncludesAreNamedWithLineAndWhatIsAllowed) {
  expectSays(messageOf(tube("include:\n  - {part: meadow}\n")),
             "source.yaml:9: include[0].part: meadow: must be a part that VEST ships: hollow");
  expectSays(messageOf(tube("include:\n  - {part: hollow, file: b.yaml}\n")), "source.yaml:9: include[0]");
  expectSays(messageOf(tube("include:\n  - {file: ../b.yaml}\n")),
             "source.yaml:9: include[0].file: ../b.yaml");
  expectSays(messageOf(tube("include:\n  - {file: part.yaml}\n"), "vest_part: 2\nobjects: []\n"),
             "part.yaml:1: vest_part: 2");
  expectSays(messageOf(tube("include:\n  - {file: part.yaml}\n"), "vest_part: 1\nobjects:\n  - {name: b}\n"),
             "part.yaml:3: objects[0].organ: missing");
}

TEST(Source, WhatBakingFindsIsNamedWithItsLineToo) {
  expectSays(messageOf(tube("    fixed:\n      - {rings: [0, 99]}\n")),
             "source.yaml:9: object a: rings 0 to 99: must be rings of 0 to 9");
  expectSays(messageOf(tube("    clear: [{of: b, gap: 0.001}]\n")),
             "source.yaml:8: object a: refers to b, which is no object of the scene; those are a");
  std::string source = tube("");
  source.replace(source.find("start_dome: 0.002"), 17, "start_dome: 0.900");
  expectSays(messageOf(source), "source.yaml:7: object a: domes are longer");
}

TEST(Source, AnUnknownMaterialIsNamed) {
  std::string source = tube("    springs: 180\n");
  source.replace(source.find("material: tube"), 14, "material: wood");
  expectSays(messageOf(source), "source.yaml:6: object a: material wood is not in the database: ");
}

TEST(Source, AConnectionThatReachesNothingIsAnError) {
  const std::string source =
      tube("    springs: 180\n    connect: [{to: b, rings: [0, 1], within: 0.001, stiffness: 1}]\n") +
      "  - {name: b, mirror_of: a, connect: [], tube: {centre: [[0,1,0],[0.05,1,0]], reference: [0,0,1], "
      "rings: 10, around: 6, start_dome: 0.002, end_dome: 0.002, sections: [{at: 0, radii: [0.002]}]}}\n";
  expectSays(messageOf(source), "source.yaml:9: object a: connect to b: no knot lies within");
}

TEST(Materials, TheShippedDatabaseLoadsAndIsPositive) {
  const auto materials = readMaterials(kPackage + "/data/materials.yaml");
  for (const char* name : {"uterus", "tube", "ovary", "ligament", "artery", "vein", "intestine", "liver"}) {
    ASSERT_EQ(materials.count(name), 1u) << name;
    EXPECT_GT(materials.at(name).law().youngs_modulus, 0);
    EXPECT_NEAR(materials.at(name).at("density").value, 1030, 60);
  }
}

// The nets beside a source are what the source says: nobody edited one without the other. Positions are left
// out, since settling moves them; everything else agrees within the rounding of libm between machines.
TEST(Bake, WhatIsShippedIsWhatTheSourceBakesTo) {
  const auto materials = readMaterials(kPackage + "/data/materials.yaml");
  for (const std::string scene : {"gynaecology", "slab", "tube", "cut_tube", "touch_slab", "peristalsis"}) {
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
      ASSERT_EQ(a.skin.texture_coordinates.size(), b.skin.texture_coordinates.size());
      for (std::size_t v = 0; v < a.skin.texture_coordinates.size(); ++v)
        for (std::size_t k = 0; k < 2; ++k)
          EXPECT_NEAR(a.skin.texture_coordinates[v][k], b.skin.texture_coordinates[v][k], 1e-5);
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

/// A source of a few kilobytes asks for trees and parts without end: it is refused before they are made.
TEST(Source, HasNoMoreObjectsEndsOfTreesAndPartsThanAScene) {
  std::string many = "vest_source: 1\nname: t\nobjects:\n";
  for (int i = 0; i <= 1000; ++i)
    many += "  - {name: a" + std::to_string(i) +
            ", organ: tube, material: tube, tube: {centre: [[0,0,0],[0.05,0,0]], reference: [0,0,1], rings: "
            "10, around: 6, sections: [{at: 0, radii: [0.002]}]}}\n";
  EXPECT_NE(messageOf(many).find("more than 1000 objects"), std::string::npos) << messageOf(many);
  std::string trees = "vest_source: 1\nname: t\nobjects:\n";
  for (const int ends : {3, 199, 199})
    trees += "  - {name: t" + std::to_string(trees.size()) +
             ", organ: artery, material: artery, tree: {root: [-0.3, 0, 0.05], radius: 0.0003, region: "
             "{centre: [0, 0, 0.05], half_axes: [0.2, 0.2, 0.2]}, terminals: " +
             std::to_string(ends) + "}}\n";
  EXPECT_NE(messageOf(trees).find("tree: terminals: 401 with the trees before it; allowed: 400"),
            std::string::npos)
      << messageOf(trees);
  std::string parts = "vest_source: 1\nname: t\ninclude:\n";
  for (int i = 0; i < 5; ++i) parts += "  - {file: part.yaml}\n";
  const std::string part = "vest_part: 1\nobjects: []\n#" + std::string(4000000, ' ') + "\n";
  EXPECT_NE(messageOf(parts, part).find("the parts have 20000"), std::string::npos) << messageOf(parts, part);
}

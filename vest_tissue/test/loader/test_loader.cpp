#include <string>

#include <gtest/gtest.h>

#include "temporary_scene.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

using vest::scene::loadScene;

namespace {

const char* const kScene =
    "name: pair\n"
    "gravity: [0, 0, -9.81]\n"
    "objects:\n"
    "  - name: chain\n"
    "    model: net\n"
    "    nodes: nodes.csv\n"
    "    links: links.csv\n"
    "    fixed: fixed.csv\n"
    "    knot_mass: 0.001\n"
    "    link_area: 1e-6\n"
    "    material: {youngs_modulus: 10000, density: 1000}\n"
    "solution: {dt: 0.001}\n";
const char* const kNodes = "node,x,y,z\n0,0,0,0\n1,0.01,0,0\n2,0.02,0,0\n";
const char* const kLinks = "n0,n1\n0,1\n1,2\n";
const char* const kFixed = "node\n0\n";

// Loads the scene above with some texts replaced; returns the message, empty if it loaded.
struct Attempt {
  std::string scene = kScene, nodes = kNodes, links = kLinks, fixed = kFixed;

  static void replace(std::string& text, const std::string& from, const std::string& to) {
    const auto place = text.find(from);
    ASSERT_NE(place, std::string::npos) << from;
    text.replace(place, from.size(), to);
  }
  std::string message() const {
    vest::test::TemporaryScene folder;
    const std::string path = folder.write("scene.yaml", scene);
    folder.write("nodes.csv", nodes);
    folder.write("links.csv", links);
    folder.write("fixed.csv", fixed);
    try {
      loadScene(path);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  }
};

void expectSays(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << "one line: " << message;
}

}  // namespace

TEST(Loader, AGoodSceneLoadsWithWhatItSays) {
  vest::test::TemporaryScene folder;
  const std::string path = folder.write("scene.yaml", kScene);
  folder.write("nodes.csv", kNodes);
  folder.write("links.csv", kLinks);
  folder.write("fixed.csv", kFixed);
  const auto scene = loadScene(path);
  EXPECT_EQ(scene.name, "pair");
  ASSERT_EQ(scene.objects.size(), 1u);
  const auto& chain = scene.objects[0];
  EXPECT_EQ(chain.mass.size(), 3u);
  EXPECT_EQ(chain.fixed[0], 1);
  EXPECT_EQ(chain.fixed[1], 0);
  EXPECT_NEAR(chain.links[1].rest, 0.01, 1e-15);
  EXPECT_EQ(chain.links[1].area, 1e-6);
  EXPECT_EQ(scene.hash.size(), 16u);
}

TEST(Loader, TheHashCoversEveryFileThatTheSceneRefersTo) {
  vest::test::TemporaryScene folder;
  const std::string path = folder.write("scene.yaml", kScene);
  folder.write("nodes.csv", kNodes);
  folder.write("links.csv", kLinks);
  folder.write("fixed.csv", kFixed);
  const std::string first = loadScene(path).hash;
  EXPECT_EQ(loadScene(path).hash, first);
  folder.write("fixed.csv", "node\n1\n");
  EXPECT_NE(loadScene(path).hash, first);
}

TEST(Loader, AMissingSceneFileIsNamed) {
  try {
    loadScene("/nowhere/scene.yaml");
    FAIL();
  } catch (const std::invalid_argument& error) {
    expectSays(error.what(), {"/nowhere/scene.yaml", "No such file", "readable file"});
  }
}

TEST(Loader, UnknownKeysAreErrorsWithLineAndTheKnownOnes) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "knot_mass", "knot_mas");
  expectSays(attempt.message(), {"scene.yaml:9: objects[0].knot_mas", "unknown key", "knot_mass"});
}

TEST(Loader, DoubledKeysAreErrors) {
  Attempt attempt;
  attempt.scene += "name: again\n";
  expectSays(attempt.message(), {"scene.yaml:13", "name", "key stands twice"});
}

TEST(Loader, AMissingRequiredKeyIsNamed) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "    links: links.csv\n", "");
  expectSays(attempt.message(), {"objects[0].links: missing: is required"});
}

TEST(Loader, AWrongTypeNamesFieldValueAndWhatIsAllowed) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "[0, 0, -9.81]", "down");
  expectSays(attempt.message(), {"scene.yaml:2: gravity: down: must be a list of 3 numbers"});
}

TEST(Loader, NotANumberIsRefused) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "youngs_modulus: 10000", "youngs_modulus: .nan");
  expectSays(attempt.message(), {"scene.yaml:11: objects[0].material.youngs_modulus: .nan"});
  Attempt table;
  Attempt::replace(table.nodes, "1,0.01,0,0", "1,nan,0,0");
  expectSays(table.message(), {"nodes.csv:3: x: nan: must be a finite number"});
}

TEST(Loader, NegativeMassIsRefused) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "knot_mass: 0.001", "knot_mass: -1");
  expectSays(attempt.message(), {"scene.yaml:9: objects[0].knot_mass: -1: must be a number > 0"});
  Attempt table;
  table.nodes = "node,x,y,z,mass\n0,0,0,0,1\n1,0.01,0,0,-2\n2,0.02,0,0,1\n";
  expectSays(table.message(), {"nodes.csv:3: mass: -2", "must be > 0"});
}

TEST(Loader, KnotsHaveTheBloodThatTheSceneGivesThem) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "    knot_mass",
                   "    thermal: {perfusion: 0.01}\n    knot_perfusion: links.csv\n    knot_mass");
  expectSays(attempt.message(), {"links.csv:1", "perfusion"});
  vest::test::TemporaryScene folder;
  Attempt::replace(attempt.scene, "knot_perfusion: links.csv", "knot_perfusion: blood.csv");
  const std::string path = folder.write("scene.yaml", attempt.scene);
  folder.write("nodes.csv", kNodes), folder.write("links.csv", kLinks), folder.write("fixed.csv", kFixed);
  const auto load = [&](const char* rows) {
    folder.write("blood.csv", std::string("node,perfusion\n") + rows);
    return loadScene(path).objects[0].knot_perfusion;
  };
  EXPECT_EQ(load("1,0.002\n"), (std::vector<double>{0.01, 0.002, 0.01}));
  const auto refused = [&](const char* rows) {
    try {
      load(rows);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  expectSays(refused("1,2\n"), {"blood.csv:2: perfusion: 2", "must be from 0 to 1"});
  expectSays(refused("1,0\n1,0\n"), {"blood.csv:3: node: 1: must be there once"});
  expectSays(refused("3,0\n"), {"blood.csv:2: node: 3"});
}

TEST(Loader, DanglingLinksAreRefused) {
  Attempt attempt;
  Attempt::replace(attempt.links, "1,2", "1,7");
  expectSays(attempt.message(), {"links.csv:3: n1: 7: must be a whole number from 0 to 2"});
}

TEST(Loader, DoubleLinksAreRefused) {
  Attempt attempt;
  Attempt::replace(attempt.links, "1,2", "1,0");
  expectSays(attempt.message(), {"chain.links[1]: 1-0: must not stand there twice"});
}

TEST(Loader, DoubleNodesAreRefused) {
  Attempt attempt;
  Attempt::replace(attempt.nodes, "2,0.02", "1,0.02");
  expectSays(attempt.message(), {"nodes.csv:4: node: 1: must be there once"});
}

TEST(Loader, LinksOfNoLengthAreRefused) {
  Attempt attempt;
  Attempt::replace(attempt.nodes, "1,0.01", "1,0");
  expectSays(attempt.message(), {"chain.links.rest_length[0]", "must be > 0"});
}

TEST(Loader, MissingSideFilesAreNamedByTheFieldThatAsksForThem) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "fixed: fixed.csv", "fixed: gone.csv");
  expectSays(attempt.message(), {"scene.yaml:8: objects[0].fixed: gone.csv: must name a readable file"});
}

TEST(Loader, PathsOutsideOfTheScenesFolderAreRefused) {
  for (const char* path :
       {"../links.csv", "/etc/passwd", "a/../../b.csv", "http://host/links.csv", "~/links.csv"}) {
    Attempt attempt;
    Attempt::replace(attempt.scene, "links: links.csv", std::string("links: \"") + path + "\"");
    expectSays(attempt.message(), {"scene.yaml:7: objects[0].links", "must be a relative path"});
  }
}

TEST(Loader, AliasesAreRefused) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "gravity: [0, 0, -9.81]", "gravity: &g [0, 0, -9.81]");
  expectSays(attempt.message(), {"scene.yaml:2: document: an anchor", "allowed: no anchors and aliases"});
}

TEST(Loader, DeepNestingIsRefused) {
  Attempt attempt;
  attempt.scene += "deep: " + std::string(40, '[') + std::string(40, ']') + "\n";
  expectSays(attempt.message(), {"scene.yaml:13: document: nesting deeper than 32"});
  Attempt deeper;
  deeper.scene += "deep: " + std::string(100000, '[') + "\n";
  EXPECT_NE(deeper.message(), "") << "a hundred thousand levels must be refused, not overflow the stack";
}

TEST(Loader, HugeFilesAreRefused) {
  Attempt attempt;
  attempt.scene += "# " + std::string(5u << 20, 'x') + "\n";
  expectSays(attempt.message(), {"at most 4194304 bytes"});
}

TEST(Loader, BrokenYamlNamesTheLine) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "gravity: [0, 0, -9.81]", "gravity: [0, 0");
  expectSays(attempt.message(), {"scene.yaml:", "well-formed YAML"});
}

TEST(Loader, TablesWithUnknownColumnsOrRaggedRowsAreRefused) {
  Attempt header;
  Attempt::replace(header.links, "n0,n1", "n0,n1,colour");
  expectSays(header.message(), {"links.csv:1: header: colour: columns are n0 n1"});
  Attempt row;
  Attempt::replace(row.links, "1,2", "1,2,3");
  expectSays(row.message(), {"links.csv:3: row: 3 cells: must have 2 cells"});
}

TEST(Loader, AVolumeWithoutAShapeIsRefused) {
  Attempt attempt;
  Attempt::replace(attempt.scene, "model: net", "model: volume");
  expectSays(attempt.message(),
             {"scene.yaml:5: objects[0].model: volume: must have one of image, surface, mesh"});
}

TEST(Baked, WhatIsWrittenIsReadBackAndCutFilesAreRefused) {
  const std::string folder = std::string(VEST_TISSUE_SOURCE_DIR) + "/scenes/tube";
  const auto object = loadScene(folder + "/tube.yaml").objects.at(0);
  const std::string bytes = vest::scene::encodeBaked(object);
  vest::scene::Object again;
  vest::scene::decodeBaked(bytes, "again.net", again);
  EXPECT_EQ(vest::scene::encodeBaked(again), bytes);
  for (std::size_t length = 0; length < bytes.size(); length += 97) {
    vest::scene::Object cut;
    EXPECT_THROW(vest::scene::decodeBaked(bytes.substr(0, length), "cut.net", cut), std::invalid_argument)
        << length;
  }
  vest::scene::Object longer;
  EXPECT_THROW(vest::scene::decodeBaked(bytes + "x", "long.net", longer), std::invalid_argument);
}

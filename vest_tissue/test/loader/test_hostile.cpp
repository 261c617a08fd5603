// Scene files of somebody who wants harm, or who made a mistake: one message in bounded time and memory.
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "../../src/cli/check_table.h"
#include "../../src/cli/edit_source.h"
#include "temporary_scene.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/world.h"

namespace {

using vest::test::TemporaryScene;

/// The scenes of fuzz/corpus: a text of several files, "=== NAME" begins the next.
class Scene {
 public:
  explicit Scene(const std::string& kept) {
    const std::string text =
        vest::files::read(std::string(VEST_TISSUE_SOURCE_DIR) + "/../fuzz/corpus/scene/" + kept, 1 << 20);
    std::istringstream lines(text);
    std::string name = "scene.yaml";
    for (std::string line; std::getline(lines, line);) {
      if (line.compare(0, 4, "=== ") == 0)
        name = line.substr(4);
      else
        files[name] += line + (lines.eof() ? "" : "\n");
    }
  }
  Scene& with(const std::string& name, const std::string& from, const std::string& to) {
    const std::size_t at = files[name].find(from);
    EXPECT_NE(at, std::string::npos) << from << " in " << name;
    if (at != std::string::npos) files[name].replace(at, from.size(), to);
    return *this;
  }
  std::string path() const {
    std::string scene;
    for (const auto& [name, bytes] : files) {
      const std::string file = folder_.write(name, bytes);
      if (name == "scene.yaml") scene = file;
    }
    return scene;
  }
  /// What loading it says; empty: it loads.
  std::string message() const {
    try {
      vest::scene::loadScene(path());
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  }
  const std::string& folder() const { return folder_.folder(); }
  std::map<std::string, std::string> files;

 private:
  TemporaryScene folder_;
};

void says(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
  EXPECT_EQ(vest::files::shown(message, 5000), message) << "one printable line";
}

TEST(Hostile, TheKeptScenesLoadAndStart) {
  for (const char* name : {"two", "static", "surface", "mesh", "image", "database"}) {
    Scene scene(name);
    EXPECT_EQ(scene.message(), "") << name;
    auto d = vest::scene::loadScene(scene.path());
    d.cache_directory.clear();
    EXPECT_EQ(vest::tools::startFault(d), "") << name;
  }
}

TEST(Hostile, MillionsOfValuesAreRefusedBeforeTheyAreATree) {
  Scene scene("two");
  std::string list = "objects: [0";
  while (list.size() < (4u << 20) - 100) list += ",0";
  scene.files["scene.yaml"] = list + "]\n";
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  says(scene.message(), {"scene.yaml:1: document: more than", "values"});
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100 * 1024) << "kB; a tree of them took 1.4 GB";
}

TEST(Hostile, NobodyWaitsForAPipeAndNoFileIsElsewhere) {
  const Scene scene("two");
  scene.path();
  const std::string nodes = scene.folder() + "/nodes.csv";
  const auto message = [&] {
    try {
      vest::scene::loadScene(scene.folder() + "/scene.yaml");
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("loaded");
  };
  std::filesystem::remove(nodes);
  ASSERT_EQ(mkfifo(nodes.c_str(), 0600), 0);
  says(message(), {"objects[0].nodes", "nodes.csv", "it is: a pipe"});
  std::filesystem::remove(nodes);
  std::filesystem::create_directory(nodes);
  says(message(), {"objects[0].nodes", "it is: a folder"});
  std::filesystem::remove(nodes);
  std::filesystem::create_symlink("/etc/hostname", nodes);
  says(message(), {"objects[0].nodes", "it is: a link to elsewhere"});
  std::filesystem::remove(nodes);
  std::filesystem::create_symlink("fem.csv", nodes);
  says(message(), {"links.csv"});  // a link within the folder is read: its nodes are others
}

TEST(Hostile, ATableHasAtMostEightMillionValues) {
  Scene scene("two");
  std::string& ties = scene.files["ties.csv"];
  const std::size_t row = ties.find('\n') + 1;
  const std::string one = ties.substr(row, ties.find('\n', row) + 1 - row);
  while (ties.size() < 40000000) ties += one;
  says(scene.message(), {"ties.csv:", "row: 533334: must be at most 533333 rows of 15 columns"});
}

TEST(Hostile, OneFileManyTimesIsNotReadWithoutEnd) {
  Scene scene("two");
  std::string objects = "objects:\n";
  for (int i = 0; i < 8; ++i)
    objects +=
        "  - {name: a" + std::to_string(i) +
        ", nodes: nodes.csv, links: big.csv, knot_mass: 1, link_area: 1, material: {youngs_modulus: 1}}\n";
  scene.files["scene.yaml"] = objects;
  scene.files["big.csv"] = "n0,n1\n#" + std::string(30u << 20, ' ') + "\n0,1\n";
  says(scene.message(), {"objects[4].links", "bytes in files"});
}

TEST(Hostile, ASecondDocumentIsRefused) {
  Scene scene("two");
  scene.files["scene.yaml"] += "---\nobjects: []\n";
  says(scene.message(), {"scene.yaml:", "a second document"});
}

TEST(Hostile, WhatSinglePrecisionOrAStepCannotHoldIsRefusedByName) {
  says(Scene("two").with("nodes.csv", "\n17,0.02,", "\n17,1e39,").message(), {"nodes.csv:19: x", "1e+39"});
  says(Scene("two").with("nodes.csv", "\n17,0.02,", "\n17,1e9,").message(), {"nodes.csv:19: x", "1e+09"});
  // A blank in a number does not make it another one.
  says(Scene("two").with("nodes.csv", "\n17,0.02,", "\n17,0.0 2,").message(), {"nodes.csv:19: x", "0.0 2"});
  EXPECT_EQ(Scene("two").with("nodes.csv", "\n17,0.02,", "\n 17 ,\t0.02 ,").message(), "");
  says(Scene("two").with("fem.csv", "\n7,0.07,", "\n7,1e9,").message(), {"fem.csv:9: node 7", "1e+09"});
  says(Scene("database").with("links.csv", "0,1,0.01,", "0,1,1e308,").message(),
       {"links.rest_length[0]", "1e+308"});
  says(Scene("database").with("links.csv", "0,1,0.01,0,", "0,1,0.01,1e39,").message(),
       {"links.stiffness[0]", "1e+39"});
  says(Scene("two").with("scene.yaml", "-9.81]", "-101]").message(),
       {"scene.yaml:3: gravity", "-100 to 100"});
  EXPECT_EQ(Scene("two").with("scene.yaml", "-9.81]", "-100]").message(), "");
  says(Scene("database").with("nodes.csv", "\n1,0.01,", "\n1,400000,").message(),
       {"links.rest_length", "resolves"});
}

TEST(Hostile, TetrahedraAreRefusedByFileAndLine) {
  const std::string tets = Scene("two").files["tets.csv"];
  const std::string first =
      tets.substr(tets.find('\n') + 1, tets.find('\n', tets.find('\n') + 1) - tets.find('\n') - 1);
  says(Scene("two").with("tets.csv", "7,3,5,6", "7,3,6,5").message(),
       {"tets.csv:6: tetrahedron 4", "inverted"});
  says(Scene("two").with("tets.csv", "7,3,5,6", "7,3,3,6").message(), {"tets.csv:6: tetrahedron 4", "flat"});
  says(Scene("two").with("tets.csv", "n3\n", "n3\n" + first + "\n").message(),
       {"tets.csv:3: tetrahedron 1", "twice"});
  Scene orphan("two");
  orphan.files["fem.csv"] += "8,0,0,0\n";
  says(orphan.message(), {"fem.csv:10: node 8", "belongs to no tetrahedron"});
  Scene still("static");
  still.files["fem.csv"] += "8,0,0,0\n";
  EXPECT_EQ(still.message(), "") << "an equilibrium leaves such a node where it is";
}

TEST(Hostile, SurfacesOfKnotsAreClosedFromOutsideAndOfThreeCorners) {
  says(Scene("two").with("triangles.csv", "n2\n", "n2\n0,0,0\n").message(),
       {"block.contact_triangles[0]", "knot 0 twice"});
  Scene twice("two");
  twice.files["floor.csv"] += "1,2,0\n";
  says(twice.message(), {"floor.contact_triangles[2]", "stands there twice"});
  // Each triangle turned round.
  const auto turned = [](const std::string& csv) {
    std::istringstream lines(csv);
    std::string all, line;
    std::getline(lines, line);
    for (all = line + "\n"; std::getline(lines, line);) {
      const auto a = line.find(','), b = line.rfind(',');
      all += line.substr(a + 1, b - a) + line.substr(0, a) + line.substr(b) + "\n";
    }
    return all;
  };
  Scene inside("two");
  inside.files["triangles.csv"] = turned(inside.files["triangles.csv"]);
  says(inside.message(), {"block.contact_triangles[0]", "inside out"});
  inside.with("scene.yaml", "organ: liver", "organ: cavity");
  EXPECT_EQ(inside.message(), "") << "one looks at a cavity from within";
  says(Scene("two").with("floor.csv", "1,3,2", "1,2,3").message(),
       {"floor.contact_triangles[1]", "turned against [0]"});
}

/// A cube of 0.02 m in the formats of surfaces; one of its corners is at `z` instead of 0.02. In STL only one
/// triangle says so: the others keep the corner.
std::string cubeWith(const std::string& ending, const std::string& z) {
  const int faces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                            {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  const auto corner = [](int k) {
    return std::string(k & 1 ? "0.02 " : "0 ") + (k & 2 ? "0.02 " : "0 ") + (k & 4 ? "0.02" : "0");
  };
  std::string text = ending == "stl" ? "solid a\n"
                     : ending == "ply"
                         ? "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\n"
                           "property double z\nelement face 12\nproperty list uchar int vertex_indices\n"
                           "end_header\n"
                         : "";
  if (ending != "stl")
    for (int k = 0; k < 8; ++k)
      text += (ending == "obj" ? "v " : "") + (k == 7 ? "0.02 0.02 " + z : corner(k)) + "\n";
  int first = 1;
  for (const auto& f : faces) {
    const auto number = [&](int k) { return " " + std::to_string(ending == "obj" ? k + 1 : k); };
    if (ending != "stl") {
      text += (ending == "obj" ? "f" : "3") + number(f[0]) + number(f[1]) + number(f[2]) + "\n";
      continue;
    }
    text += "facet normal 0 0 0\nouter loop\n";
    for (const int k : f) text += "vertex " + (k == 7 && first-- > 0 ? "0.02 0.02 " + z : corner(k)) + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + (ending == "stl" ? "endsolid\n" : "");
}

TEST(Hostile, AVertexFarAwayIsRefusedWithBothSizes) {
  for (const std::string ending : {"obj", "stl", "ply"}) {
    for (const auto& [z, shown] :
         {std::pair{"1e5", "(0.02, 0.02, 100000)"}, {"1e30", "(0.02, 0.02, 1e+30)"}}) {
      SCOPED_TRACE(ending + " " + z);
      Scene surface("surface");
      surface.with("scene.yaml", "cube.obj", "cube." + ending).with("scene.yaml", "    skin: skin.ply\n", "");
      surface.files["cube." + ending] = cubeWith(ending, z);
      says(surface.message(), {"objects[0].surface: cube.", shown, "(0.643"});
      Scene skin("surface");
      skin.with("scene.yaml", "skin.ply", "skin." + ending).files["skin." + ending] = cubeWith(ending, z);
      says(skin.message(), {"objects[0].skin: skin.", "far from the mesh", shown, "(0.022, 0.022, 0.022)"});
      Scene mesh("mesh");
      mesh.with("scene.yaml", "mesh: a.msh", "mesh: a.msh\n    skin: skin." + ending);
      mesh.files["skin." + ending] = cubeWith(ending, z);
      says(mesh.message(), {"objects[0].skin: skin.", "far from the mesh", shown, "(1, 1, 1)"});
    }
    Scene whole("surface");
    whole.with("scene.yaml", "cube.obj", "cube." + ending).files["cube." + ending] = cubeWith(ending, "0.02");
    EXPECT_EQ(whole.message(), "") << ending;
  }
}

TEST(Hostile, ARigidSurfaceIsNoLargerThanWhatMovesCanFeel) {
  Scene scene("two");
  scene.with("scene.yaml", "model: rigid\n    nodes: fem.csv", "model: rigid\n    nodes: walls.csv");
  const std::string walls = scene.files["fem.csv"], corner = "\n3,0.07,0.02,";
  ASSERT_NE(walls.find(corner), std::string::npos);
  const auto with = [&](const std::string& z) {
    std::string text = walls;
    const std::size_t at = text.find(corner) + corner.size();
    scene.files["walls.csv"] = text.replace(at, text.find('\n', at) - at, z);
    return scene.message();
  };
  EXPECT_EQ(with("0.05"), "");
  EXPECT_EQ(with("3"), "") << "a floor of metres under an organ of centimetres";
  says(with("20"), {"scene.yaml: floor: (0.02, 0.02, 19.95) m", "felt every 0.12468", "(0.07, 0.02, 0.02) m",
                    "160 times"});
  says(with("1e5"), {"scene.yaml: floor: (0.02, 0.02, 99999.9) m", "felt every 625 m", "160 times"});
  std::string& text = scene.files["scene.yaml"];
  const std::size_t floor = text.find("  - name: floor"), end = text.find("connections:");
  const std::string first = text.substr(floor, end - floor);
  text.erase(end).erase(floor);
  text.insert(text.find("  - name: block"), first);
  EXPECT_EQ(with("10"), "") << "all that moves counts, wherever it stands";
  says(with("1e30"), {"walls.csv:5: z: 1e+30", "must be a coordinate from -500000 to 500000"});
}

/// Each box is a small file, and a grid of five million points.
TEST(Hostile, WallsAreFeltOnNoMorePointsThanFit) {
  Scene scene("two");
  scene.files["box.csv"] = "node,x,y,z\n0,1,1,1\n1,1.32,1,1\n2,1,1.32,1\n3,1,1,1.32\n";
  scene.files["faces.csv"] = "n0,n1,n2\n0,2,1\n0,1,3\n1,2,3\n2,0,3\n";
  const auto add = [&](const std::string& name) {
    scene.with("scene.yaml", "connections:",
               "  - {name: " + name +
                   ", model: rigid, nodes: box.csv, links: none.csv, knot_mass: 1, link_area: 1e-5, "
                   "triangles: faces.csv, material: {youngs_modulus: 6000}}\nconnections:");
  };
  for (int i = 0; i < 6; ++i) add("box" + std::to_string(i));
  EXPECT_EQ(scene.message(), "");
  add("box6");
  says(scene.message(),
       {"scene.yaml: box6: with it 3.6", "points on which walls are felt", "a scene may have 3.35544e+07"});
  // Triangles as long as the object itself: each point looks at all of them.
  Scene fan("two");
  std::string nodes = "node,x,y,z\n0,0.2,0.2,0.2\n", faces = "n0,n1,n2\n";
  for (int i = 0; i <= 1200; ++i) {
    nodes += std::to_string(i + 1) + "," + std::to_string(0.2 + 2.5e-4 * i) + "," +
             std::to_string(0.5 - 2.5e-4 * i) + "," + std::to_string(0.2 + 0.003 * (i % 97)) + "\n";
    if (i > 0) faces += "0," + std::to_string(i) + "," + std::to_string(i + 1) + "\n";
  }
  fan.files["box.csv"] = nodes, fan.files["faces.csv"] = faces;
  fan.with("scene.yaml", "connections:",
           "  - {name: fan, model: rigid, nodes: box.csv, links: none.csv, knot_mass: 1, link_area: 1e-5, "
           "triangles: faces.csv, material: {youngs_modulus: 6000}}\nconnections:");
  says(fan.message(),
       {"scene.yaml: fan: with it", "looks from such a point at a triangle", "a scene may have 5e+08"});
}

/// What a World asks of a scene beyond what its reader does.
std::string refusedByWorld(const Scene& scene) {
  try {
    auto d = vest::scene::loadScene(scene.path());
    d.cache_directory.clear();
    vest::scene::World world(d);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

/// A sheet of 150 x 150 knots is a matrix of gigabytes where its springs are stiff.
TEST(Hostile, AStiffNetIsNoLargerThanItsMatrix) {
  constexpr int kSide = 150;
  std::string nodes = "node,x,y,z\n", links = "n0,n1\n";
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const int n = kSide * j + i;
      nodes += std::to_string(n) + "," + std::to_string(i) + "e-3," + std::to_string(j) + "e-3,0.05\n";
      if (i + 1 < kSide) links += std::to_string(n) + "," + std::to_string(n + 1) + "\n";
      if (j + 1 < kSide) links += std::to_string(n) + "," + std::to_string(n + kSide) + "\n";
    }
  Scene scene("two");
  std::string& text = scene.files["scene.yaml"];
  text.erase(text.find("objects:\n") + 9);
  text +=
      "  - {name: sheet, model: net, nodes: nodes.csv, links: links.csv, fixed: fixed.csv, knot_mass: 1e-6, "
      "link_area: 1e-5, material: {youngs_modulus: 1e9, density: 1000}}\n";
  scene.files["nodes.csv"] = nodes, scene.files["links.csv"] = links;
  EXPECT_EQ(scene.message(), "");
  says(refusedByWorld(scene),
       {"object 'sheet': its springs are stiff", "products (allowed: 2e+07 and 4e+09"});
}

/// Tetrahedra between nodes that are far apart: each node couples with each other.
TEST(Hostile, ElementsThatCoupleAllNodesAreRefusedBeforeTheirMatrix) {
  constexpr unsigned kNodes = 5000;
  std::string nodes = "node,x,y,z\n", tets = "n0,n1,n2,n3\n";
  std::vector<Eigen::Vector3d> x;
  unsigned seed = 1;
  const auto next = [&seed] { return (seed = 1664525u * seed + 1013904223u) >> 8; };
  for (unsigned n = 0; n < kNodes; ++n) {
    const unsigned p[3] = {next() % 1000, next() % 1000, next() % 1000};
    x.emplace_back(p[0], p[1], p[2]);
    nodes += std::to_string(n) + "," + std::to_string(p[0]) + "e-4," + std::to_string(p[1]) + "e-4," +
             std::to_string(p[2]) + "e-4\n";
  }
  for (unsigned made = 0; made < 6 * kNodes;) {
    unsigned t[4] = {made % kNodes, next() % kNodes, next() % kNodes, next() % kNodes};
    double six = (x[t[1]] - x[t[0]]).dot((x[t[2]] - x[t[0]]).cross(x[t[3]] - x[t[0]]));
    if (six < 0) std::swap(t[2], t[3]), six = -six;
    if (six < 1e6) continue;
    ++made;
    tets += std::to_string(t[0]) + "," + std::to_string(t[1]) + "," + std::to_string(t[2]) + "," +
            std::to_string(t[3]) + "\n";
  }
  Scene scene("two");
  std::string& text = scene.files["scene.yaml"];
  text.erase(text.find("objects:\n") + 9);
  text +=
      "  - {name: tangle, model: fem, nodes: nodes.csv, tetrahedra: tets.csv, fixed_boxes: [[[0, 0, 0], "
      "[0.01, 0.1, 0.1]]], material: {youngs_modulus: 6000, poisson_ratio: 0.4, density: 1000}}\n";
  scene.files["nodes.csv"] = nodes, scene.files["tets.csv"] = tets;
  says(refusedByWorld(scene), {"object 'tangle': its matrix has more than 5000000 blocks"});
}

TEST(Hostile, SurfaceFilesAreRefusedByFieldAndWhy) {
  says(Scene("surface").with("skin.ply", "0.02 0.02 0.02\n", "0.02 0.02 1e39\n").message(),
       {"skin.ply:", "1e+39"});
  Scene inside("surface");
  std::string& obj = inside.files["cube.obj"];
  for (std::size_t at = obj.find("f "); at != std::string::npos; at = obj.find("\nf ", at + 1)) {
    const std::size_t a = obj.find(' ', at) + 1, b = obj.find(' ', a) + 1, c = obj.find(' ', b) + 1,
                      end = obj.find('\n', c);
    obj.replace(a, end - a, obj.substr(b, c - b) + obj.substr(a, b - a) + obj.substr(c, end - c));
  }
  says(inside.message(), {"objects[0].surface", "inside out", "volume"});
}

/// Small files can make large worlds: many rows, and objects that share a file.
TEST(Hostile, ASceneHasNoMoreKnotsLinksAndTrianglesThanAWorldCanHold) {
  std::string nodes = "node,x,y,z\n", links = "n0,n1\n", more = links, triangles = "n0,n1,n2\n", objects;
  for (int i = 0; i < 50000; ++i) nodes += std::to_string(i) + "," + std::to_string(i) + "e-4,0,0\n";
  for (int i = 0; i < 49999; ++i) links += std::to_string(i) + "," + std::to_string(i + 1) + "\n";
  for (int k = 1; k <= 11; ++k)
    for (int i = 0; i < 49000; ++i) more += std::to_string(i) + "," + std::to_string(i + k) + "\n";
  for (int k = 1; k <= 6; ++k)
    for (int i = 0; i < 49000; ++i)
      triangles += std::to_string(i) + "," + std::to_string(i + k) + "," + std::to_string(i + 500) + "\n";
  Scene scene("two");
  scene.files["nodes.csv"] = nodes;
  scene.files["links.csv"] = more;
  says(scene.message(), {"scene.yaml", "block.links: 539000", "at most 524288"});
  scene.files["links.csv"] = links;
  scene.files["triangles.csv"] = triangles;
  says(scene.message(), {"scene.yaml", "block.contact_triangles: 294000", "at most 262144"});
  std::string& text = scene.files["scene.yaml"];
  const std::size_t at = text.find("objects:\n") + 9;
  text.erase(at);
  for (const char* name : {"a", "b", "c"})
    text += std::string("  - {name: ") + name +
            ", model: net, nodes: nodes.csv, links: links.csv, knot_mass: 1, link_area: 1e-5, material: "
            "{youngs_modulus: 6000, density: 1000}}\n";
  says(scene.message(), {"scene.yaml: c: with it 150000 knots", "a scene may have 131072"});
}

TEST(Hostile, ControlCharactersAreShownAndNotSent) {
  Scene scene("two");
  scene.files["scene.yaml"] += "\"\\e[2J\\a\\u202e\": 1\n";
  says(scene.message(), {"\\x1b[2J\\x07\\xe2\\x80\\xae", "unknown key"});
}

TEST(Hostile, ABakedSceneLiesWholeInItsFolder) {
  const TemporaryScene source, target;
  const std::string text =
      vest::files::read(std::string(VEST_TISSUE_SOURCE_DIR) + "/../fuzz/corpus/source/tube", 1 << 20);
  const auto materials =
      vest::modelling::readMaterials(std::string(VEST_TISSUE_SOURCE_DIR) + "/data/materials.yaml");
  const auto baked =
      vest::modelling::bake(vest::modelling::readSource(source.write("source.yaml", text)), materials);
  const std::string folder = target.folder() + "/scenes/new";
  vest::modelling::writeScene(baked, folder, "source.yaml", text);
  const auto d = vest::scene::loadScene(folder + "/tube.yaml");
  EXPECT_EQ(d.source, "source.yaml");
  EXPECT_EQ(vest::tools::printCheck(d), "");
  EXPECT_EQ(vest::tools::startFault(d), "");
  // A folder that cannot be written to: nothing is left behind.
  auto other = baked;
  other.objects.push_back(other.objects[0]);
  other.objects[1].name = "no/such";
  const std::string none = target.folder() + "/none";
  EXPECT_THROW(vest::modelling::writeScene(other, none, "source.yaml", text), std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_empty(none));
  // Nor where a folder has the place of its last file.
  const std::string taken = target.folder() + "/taken";
  std::filesystem::create_directories(taken + "/tube.yaml");
  EXPECT_THROW(vest::modelling::writeScene(baked, taken, "source.yaml", text), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(taken + "/tube.net"));
  // A scene that its reader would refuse: neither.
  other = baked;
  other.objects[0].rest_position[0].x() = 4e6;
  const std::string far = target.folder() + "/far";
  EXPECT_THROW(vest::modelling::writeScene(other, far, "source.yaml", text), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(far));
}

TEST(Hostile, AnEditThatMakesASceneItsReaderRefusesWritesNothing) {
  const TemporaryScene folder;
  const std::string text =
      vest::files::read(std::string(VEST_TISSUE_SOURCE_DIR) + "/../fuzz/corpus/source/tube", 1 << 20);
  const std::string source = folder.write("source.yaml", text);
  const auto materials =
      vest::modelling::readMaterials(std::string(VEST_TISSUE_SOURCE_DIR) + "/data/materials.yaml");
  const auto edited = [&](const std::string& path, const std::string& value, const std::string& to) {
    const std::string script = folder.write(
        "edits.yaml", "vest_edits: 1\nedits:\n  - {op: set, path: " + path + ", value: " + value + "}\n");
    try {
      vest::tools::editSource(source, script, folder.folder() + "/" + to, materials);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(edited("/gravity", "[0, 0, -1.62]", "moon"), "");
  EXPECT_NO_THROW(vest::scene::loadScene(folder.folder() + "/moon/tube.yaml"));
  says(edited("/gravity", "[0, 0, -1000]", "heavy"), {"gravity: (0, 0, -1000) m/s²", "from -100 to 100"});
  says(edited("/objects/tube/tube/centre/1", "[6e5, 0.05, 0.06]", "far"), {"tube.rest_position[", "500000"});
  for (const char* none : {"/heavy", "/far"})
    EXPECT_FALSE(std::filesystem::exists(folder.folder() + none)) << none;
}

TEST(Check, EveryShippedSceneIsGood) {
  std::size_t scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(VEST_TISSUE_SOURCE_DIR "/scenes")) {
    const std::string name = entry.path().filename();
    const auto d = vest::scene::loadScene(entry.path() / (name + ".yaml"));
    EXPECT_EQ(vest::tools::printCheck(d), "") << name;
    EXPECT_EQ(vest::tools::startFault(d), "") << name;
    ++scenes;
  }
  EXPECT_GE(scenes, 23u);
}

TEST(Check, WhatAnswersAtOnceIsNotThrownAboutByItsFirstStep) {
  auto d = vest::scene::loadScene(VEST_TISSUE_SOURCE_DIR "/scenes/fem_slab/fem_slab.yaml");
  d.cache_directory.clear();
  auto& slab = *std::find_if(d.objects.begin(), d.objects.end(), [](const auto& o) { return o.fem; });
  auto soft = std::make_shared<vest::fem::Description>(*slab.fem);
  soft->start_in_equilibrium = false;
  soft->material.youngs_modulus *= 0.001;  // sags by more than 5 mm
  for (auto& material : soft->materials) material.youngs_modulus *= 0.001;
  slab.fem = soft;
  EXPECT_EQ(vest::tools::startFault(d), "");
}

TEST(Check, ElementsAreJudgedAsElementsAndFaultsAreTold) {
  Scene scene("two");
  auto d = vest::scene::loadScene(scene.path());
  EXPECT_EQ(vest::tools::printCheck(d), "");
  d.objects[1].position[7].x() += 1e5;  // as if a file could say so
  EXPECT_NE(vest::tools::startFault(d), "");
}

// A bake once said good, and then that it was not.
TEST(Check, SaysOneVerdictAsItsLastLine) {
  const auto said = [](const std::vector<std::string>& faults, bool good) {
    testing::internal::CaptureStdout();
    EXPECT_EQ(vest::tools::printVerdict(faults), good);
    return testing::internal::GetCapturedStdout();
  };
  EXPECT_EQ(said({"", ""}, true), "good\n");
  EXPECT_EQ(said({"", "it does not start: no"}, false), "NOT good: it does not start: no\n");
  EXPECT_EQ(said({"it is thin", "", "it falls"}, false), "NOT good: it is thin; it falls\n");
  Scene scene("two");
  auto d = vest::scene::loadScene(scene.path());
  d.objects[1].position[7].x() += 1e5;
  testing::internal::CaptureStdout();
  vest::tools::printCheck(d), vest::tools::startFault(d);
  EXPECT_EQ(testing::internal::GetCapturedStdout().find("good"), std::string::npos);
}

}  // namespace

// Rods from files to tables.
#include <gtest/gtest.h>
#include <array>

#include <cstdio>
#include <fstream>
#include <sstream>

#include "../../src/cli/simulate_rods.h"
#include "temporary_scene.h"
#include "vest_tissue/material/sutures.h"
#include "vest_tissue/suture/rod.h"

namespace vest::tools::test {
namespace {

const char* const kScene =
    "gravity: [0, 0, 0]\n"
    "objects:\n"
    "  - name: thread\n"
    "    model: rod\n"
    "    nodes: nodes.csv\n"
    "    closed: false\n"
    "    rod: {radius: 0.01, density: 1180, youngs_modulus: 1.8e5, poisson_ratio: 0.5}\n"
    "    natural: straight\n"
    "    turn: 0.0\n"
    "    friction: 0.1\n"
    "    damping: 1.0\n"
    "    held: held.csv\n"
    "    drive: drive.csv\n"
    "    loads: loads.csv\n";

struct RodFiles {
  vest::test::TemporaryScene folder;
  RodFiles() {
    std::ostringstream nodes;
    nodes << "node,x,y,z\n";
    for (int i = 0; i <= 20; ++i) nodes << i << ',' << 0.05 * i << ",0,0\n";
    folder.write("nodes.csv", nodes.str());
    folder.write("held.csv", "node,kind\n0,1\n20,0\n");
    folder.write("drive.csv", "t,node,x,y,z,angle\n0,20,1,0,0,0\n0.5,20,0.9,0,0.1,0\n");
    folder.write("loads.csv", "node,fx,fy,fz\n10,0,0,0.5\n");
  }
  std::string with(const std::string& from, const std::string& to) const {
    std::string text = kScene;
    const auto at = text.find(from);
    if (at == std::string::npos) throw std::logic_error(from);
    return folder.write("scene.yaml", text.replace(at, from.size(), to));
  }
  static std::string refusal(const std::string& path) {
    try {
      scene::loadRods(path);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  }
};

std::vector<std::string> lines(const std::string& path) {
  std::ifstream in(path);
  std::vector<std::string> all;
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

TEST(RodScene, TablesHaveHeldNodesAndPathsAtEveryTime) {
  const RodFiles files;
  const auto scene = scene::loadRods(files.with("closed: false", "closed: false"));
  SimulateOptions options;
  options.steps = 100;
  RodTables tables{files.folder.folder() + "/r.csv", files.folder.folder() + "/p.csv", 50};
  const auto first = simulateRods(scene, options, tables);
  const auto reactions = lines(tables.reactions), path = lines(tables.path);
  ASSERT_EQ(reactions.size(), 1u + 3 * 2);
  EXPECT_EQ(reactions[0], "t,object,node,fx,fy,fz,mx,my,mz");
  EXPECT_EQ(reactions.back().rfind("0.1", 0), 0u) << reactions.back();
  EXPECT_NE(reactions.back().find(",thread,20,"), std::string::npos);
  ASSERT_EQ(path.size(), 1u + 3 * 21);
  EXPECT_EQ(path[0], "t,object,node,x,y,z");
  EXPECT_NEAR(first.positions[0][20].x(), 1.0 - 0.1 * 0.1 / 0.5, 1e-12);
  EXPECT_EQ(first.hash, simulateRods(scene, options, {}).hash);
}

TEST(RodScene, StaticsEndWhereTheDriveEnds) {
  const RodFiles files;
  const auto scene = scene::loadRods(files.with("natural: straight", "natural: shape"));
  SimulateOptions options;
  options.equilibrium = true;
  const auto end = simulateRods(scene, options, {});
  EXPECT_NEAR((end.positions[0][20] - Eigen::Vector3d(0.9, 0, 0.1)).norm(), 0.0, 1e-12);
}

TEST(RodScene, MistakesAreToldWithFileLineFieldAndWhatIsAllowed) {
  const RodFiles files;
  const std::pair<const char*, const char*> edits[] = {{"radius: 0.01", "radius: .nan"},
                                                       {"radius: 0.01", "radius: 0"},
                                                       {"density: 1180", "density: -1"},
                                                       {"poisson_ratio: 0.5", "poisson_ratio: 0.6"},
                                                       {"natural: straight", "natural: bent"},
                                                       {"closed: false", "close: false"},
                                                       {"nodes: nodes.csv", "nodes: none.csv"},
                                                       {"model: rod", "model: rods"},
                                                       {"gravity: [0, 0, 0]", "solution: {dt: 1e30}"}};
  for (const auto& [from, to] : edits) {
    const std::string told = RodFiles::refusal(files.with(from, to));
    EXPECT_NE(told.find("scene.yaml:"), std::string::npos) << to << ": " << told;
    EXPECT_EQ(told.find('\n'), std::string::npos) << told;
  }
  // Its stiffness underflows: the first step would not be finite.
  EXPECT_THROW(suture::Model(scene::loadRods(files.with("radius: 0.01", "radius: 1e-30")).objects),
               std::invalid_argument);
  const std::string good = files.with("closed: false", "closed: false");
  files.folder.write("nodes.csv", "node,x,y,z\n0,0,0,0\n1,1,0,0\n2,1,0,0\n");
  EXPECT_NE(RodFiles::refusal(good).find("nodes.csv:4: node: 2"), std::string::npos)
      << RodFiles::refusal(good);
  // Numbers that no step can hold are refused where they stand.
  const std::string moved = "t,node,x,y,z,angle\n0,20,1,0,0,0\n",
                    turned = "t,node,x,y,z,angle\n0,0,0,0,0,0\n";
  const std::array<std::string, 3> rows[] = {
      {"drive.csv", moved + "0.5,20,1e30,0,0.1,0\n", "drive.csv:3: x: 1e+30"},
      {"drive.csv", moved + "1e30,20,0.9,0,0.1,0\n", "drive.csv:3: t: 1e+30"},
      {"drive.csv", turned + "0.5,0,0,0,0,1e30\n", "drive.csv:3: angle: 1e+30"},
      {"loads.csv", "node,fx,fy,fz\n10,0,0,-1e30\n", "loads.csv:2: fz: -1e+30"},
      {"nodes.csv", "node,x,y,z\n0,0,0,0\n1,1e6,0,0\n2,1,0,0\n", "nodes.csv:3: x: 1e+06"}};
  for (const auto& [file, text, said] : rows) {
    const RodFiles others;
    const std::string scene_file = others.with("closed: false", "closed: false");
    others.folder.write(file, text);
    EXPECT_NE(RodFiles::refusal(scene_file).find(said), std::string::npos) << RodFiles::refusal(scene_file);
  }
}

TEST(RodScene, SuturesComeFromTheShippedFileByMaterialAndSize) {
  const RodFiles files;
  const std::string solid = "rod: {radius: 0.01, density: 1180, youngs_modulus: 1.8e5, poisson_ratio: 0.5}";
  const auto section = [&](const std::string& to) {
    return scene::loadRods(files.with(solid, to)).objects.rods[0].section;
  };
  // 3-0 is 0.200 to 0.249 mm thick; a monofilament bends as a solid rod of its modulus, 3 GPa.
  const suture::Section s = section("suture: {material: polypropylene, size: 3-0}");
  const double r = 0.5 * 0.0002245, pi = 3.14159265358979;
  EXPECT_NEAR(s.radius, r, 1e-12);
  EXPECT_NEAR(s.bend, 3e9 * pi * r * r * r * r / 4.0, 1e-6 * s.bend);
  EXPECT_NEAR(s.linear_density, 900 * pi * r * r, 1e-6 * s.linear_density);
  EXPECT_EQ(s.friction, 0.1);  // the scene's own goes first, at any load
  EXPECT_EQ(s.friction_fall, 0.0);
  EXPECT_EQ(section("rod: {suture: {material: polypropylene, size: 3-0}}").bend, s.bend);
  // A braid of the same size is limp, and no section lacks a number.
  EXPECT_LT(section("suture: {material: polyglactin_910, size: 3-0}").bend, 0.2 * s.bend);
  for (const char* material :
       {"polypropylene", "nylon", "polydioxanone", "sheathed_polyamide", "polyglactin_910", "silk"}) {
    for (const char* size : {"4-0", "3-0", "2-0", "0"}) {
      const auto made = section(std::string("suture: {material: ") + material + ", size: " + size + "}");
      EXPECT_GT(std::min({made.bend, made.twist, made.stretch, made.shear, made.linear_density}), 0.0);
    }
  }
  for (const char* wrong : {"suture: {material: gold, size: 3-0}", "suture: {material: silk, size: 30-0}",
                            "suture: {material: silk}", "suture: 3-0"}) {
    const std::string told = RodFiles::refusal(files.with(solid, wrong));
    EXPECT_NE(told.find("scene.yaml:"), std::string::npos) << told;
  }
  EXPECT_NE(RodFiles::refusal(files.with(solid, "suture: {material: gold, size: 3-0}")).find("polydioxanone"),
            std::string::npos);
  EXPECT_NE(RodFiles::refusal(files.with(solid, solid + "\n    suture: {material: silk, size: 3-0}"))
                .find("beside"),
            std::string::npos);
}

TEST(RodScene, AFileOfSuturesIsReadStrictly) {
  std::ifstream in(material::suturesPath());
  const std::string shipped{std::istreambuf_iterator<char>(in), {}};
  const RodFiles files;
  const std::pair<const char*, const char*> edits[] = {
      {"value: 900,", "value: -900,"},
      {"assumed: true, why: \"iso", "assumed: false, why: \"iso"},
      {"source: naleway", "source: nobody"},
      {"name: nylon", "name: polypropylene"},
      {"absorbable: false", "absorbed: false"},
      {"vest_sutures: 1", "vest_sutures: 2"},
      {"tight: {value: 0.10", "tight: {value: 0.26"}};
  for (const auto& [from, to] : edits) {
    std::string text = shipped;
    text.replace(text.find(from), std::string(from).size(), to);
    const std::string path = files.folder.write("sutures.yaml", text);
    try {
      material::readSutures(path);
      ADD_FAILURE() << to;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(std::string(error.what()).rfind(path + ":", 0), 0u) << error.what();
    }
  }
}

/// A slab of elements, 60 × 40 × 10 mm, that stands on z = 0, and a rod of steel above it.
struct RodOnSlab {
  vest::test::TemporaryScene folder;
  RodOnSlab() {
    constexpr int kX = 12, kY = 8, kZ = 2;
    const auto node = [](int i, int j, int k) { return (i * (kY + 1) + j) * (kZ + 1) + k; };
    std::ostringstream nodes, tets, fixed, rod;
    nodes << "node,x,y,z\n", tets << "n0,n1,n2,n3\n", fixed << "node\n", rod << "node,x,y,z\n";
    for (int i = 0; i <= kX; ++i)
      for (int j = 0; j <= kY; ++j)
        for (int k = 0; k <= kZ; ++k) {
          nodes << node(i, j, k) << ',' << -0.03 + 0.005 * i << ',' << -0.02 + 0.005 * j << ',' << 0.005 * k
                << '\n';
          if (k == 0) fixed << node(i, j, k) << '\n';
          if (i == kX || j == kY || k == kZ) continue;
          // Six tetrahedra of a brick: paths from one corner to the opposite one.
          for (int path = 0; path < 6; ++path) {
            const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
            int at[3] = {i, j, k}, corner[4] = {node(i, j, k), 0, 0, 0};
            for (int s = 0; s < 3; ++s) ++at[order[path][s]], corner[s + 1] = node(at[0], at[1], at[2]);
            if (path > 2) std::swap(corner[2], corner[3]);
            tets << corner[0] << ',' << corner[1] << ',' << corner[2] << ',' << corner[3] << '\n';
          }
        }
    for (int i = 0; i <= 40; ++i) rod << i << ',' << -0.025 + 0.05 * i / 40 << ",0.001,0.0125\n";
    folder.write("slab.csv", nodes.str());
    folder.write("tets.csv", tets.str());
    folder.write("fixed.csv", fixed.str());
    folder.write("rod.csv", rod.str());
    folder.write("held.csv", "node,kind\n0,0\n40,0\n");
  }
  /// @param more keys of the rod
  std::string scene(const std::string& more, const std::string& end = "") const {
    return folder.write(
        "scene.yaml",
        "objects:\n"
        "  - name: rod\n    model: rod\n    nodes: rod.csv\n    damping: 2.0\n"
        "    rod: {radius: 0.0005, density: 8000, youngs_modulus: 2.0e9, poisson_ratio: 0.3}\n" +
            more +
            "  - name: slab\n    model: fem\n    strain: corotational\n    nodes: slab.csv\n"
            "    tetrahedra: tets.csv\n    fixed: fixed.csv\n"
            "    material: {youngs_modulus: 2000, poisson_ratio: 0.4, density: 1000, rayleigh_mass: 5, "
            "rayleigh_stiffness: 0.002}\n" +
            end + "solution: {integrator: backward_euler, dt: 0.02}\n");
  }
};

TEST(RodScene, ARodComesToRestOnElementsAndPressesThem) {
  const RodOnSlab files;
  const auto scene = scene::loadRods(files.scene(""));
  ASSERT_TRUE(scene.together);
  SimulateOptions options;
  options.steps = 50;  // 1 s
  const auto end = simulateRods(scene, options, {});
  ASSERT_EQ(end.names, (std::vector<std::string>{"slab", "rod"}));
  // On the slab's surface, whose thickness is 0.5 mm; it presses the slab more than its own weight does.
  const std::size_t middle = (6 * 9 + 4) * 3 + 2;
  const double rod = end.positions[1][20].z(), under = end.positions[0][middle].z();
  EXPECT_NEAR(rod, under + 0.0005 + 0.0005, 1.5e-4);
  const auto alone = simulateRods(scene::loadRods(files.scene("    held: held.csv\n")), options, {});
  EXPECT_GT(alone.positions[1][20].z(), 0.012);
  EXPECT_LT(under, alone.positions[0][middle].z() - 1e-5);
  options.threads = 2;
  EXPECT_EQ(simulateRods(scene, options, {}).hash, end.hash);
  // At rest it is where steps end, too.
  options.equilibrium = true;
  EXPECT_NEAR(simulateRods(scene, options, {}).positions[1][20].z(), rod, 2e-5);
}

TEST(RodScene, WhatHoldsARodBesideElementsBearsItsWeight) {
  const RodOnSlab files;
  SimulateOptions options;
  options.steps = 100;
  RodTables tables{files.folder.folder() + "/r.csv", "", 100};
  simulateRods(scene::loadRods(files.scene("    held: held.csv\n")), options, tables);
  double up = 0.0, time = 0.0;
  for (const std::string& line : lines(tables.reactions)) {
    double f[3];
    if (std::sscanf(line.c_str(), "%lf,rod,%*d,%lf,%lf,%lf", &time, f, f + 1, f + 2) == 4 && time == 2.0)
      up += f[2];
  }
  const double weight = 8000.0 * 3.14159265 * 0.0005 * 0.0005 * 0.05 * 9.81;
  EXPECT_NEAR(up, weight, 0.01 * weight);
}

TEST(RodScene, WhatRodsBesideOthersMayNotHaveIsRefused) {
  const RodOnSlab files;
  const std::string named = RodFiles::refusal(
      files.scene("", "  - {name: slab, model: cylinder, point: [0, 0, 0], axis: [0, 0, 1], radius: 1}\n"));
  EXPECT_NE(named.find("name: slab: must be there once"), std::string::npos) << named;
  const std::string sutures =
      RodFiles::refusal(files.scene("", "sutures: [{name: a, material: silk, size: 2-0}]\n"));
  EXPECT_NE(sutures.find("sutures"), std::string::npos) << sutures;
  EXPECT_THROW(scene::loadScene(files.scene("")), std::invalid_argument);  // not in a session
}

}  // namespace
}  // namespace vest::tools::test

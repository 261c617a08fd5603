#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "blades.h"
#include "temporary_scene.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/tree.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

// Protects trees of vessels: branches as the rule says, radii and angles as the printed laws have them, and
// one graph that is geometry, net, tube map and the files of the circulation.

using namespace vest::modelling;

namespace {

const std::string kPackage = VEST_TISSUE_SOURCE_DIR;

TreeSpec twice() {
  TreeSpec spec;
  spec.radius = 0.002;
  spec.axiom = "A";
  spec.productions = {{'A', "F/[A][A]"}};
  spec.steps = 4;
  return spec;
}

std::string messageOf(const TreeSpec& spec) {
  try {
    growTree(spec);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

const std::string kSource = R"(vest_source: 1
name: twig
objects:
  - name: tree
    organ: artery
    material: artery
    support: 25
    bulk_modulus: 200
    tree: {root: [0, 0, 0.05], direction: [1, 0, 0], plane: [0, 1, 0], radius: 0.0015, axiom: A, productions: {A: "F/[A][A]"}, steps: 3, supply: uterine_branches_left}
    fixed: [{rings: [0, 1]}]
)";

vest::scene::Description bakeText(const std::string& text) {
  return bake(readSource("source.yaml", text), readMaterials(kPackage + "/data/materials.yaml"));
}

}  // namespace

TEST(Tree, ExponentsAreThoseInPrint) {
  EXPECT_EQ(radiusExponent(0.002), 2.33);
  EXPECT_EQ(radiusExponent(0.0005), 2.7);
  EXPECT_EQ(radiusExponent(0.00005), 3.0);
}

TEST(Tree, TwinsLeaveAtMurraysAngleAndAThinOneLeavesSideways) {
  const double twin = std::pow(0.5, 1.0 / 3);  // of flow shared alike, with Murray's own exponent
  EXPECT_NEAR(branchAngle(1, twin, twin) * 180 / M_PI, 37.5, 0.05);
  EXPECT_NEAR(branchAngle(1, 1e-3, std::cbrt(1 - 1e-9)) * 180 / M_PI, 90, 1);
}

TEST(Tree, RadiiAndAnglesObeyTheLawsAtEachBranching) {
  TreeSpec spec = twice();
  spec.productions = {{'A', "F/[A][B]"}, {'B', "F"}};
  const auto branches = growTree(spec);
  int forks = 0;
  for (std::size_t i = 0; i < branches.size(); ++i) {
    std::vector<const TreeBranch*> next;
    for (const TreeBranch& b : branches)
      if (b.parent == static_cast<int>(i)) next.push_back(&b);
    for (const TreeBranch* b : next) EXPECT_LT((b->from - branches[i].to).norm(), 1e-15);
    EXPECT_NEAR((branches[i].to - branches[i].from).norm(), 12 * branches[i].radius, 1e-12);
    if (next.size() != 2) continue;
    ++forks;
    const double r0 = branches[i].radius, r1 = next[0]->radius, r2 = next[1]->radius, x = radiusExponent(r0);
    EXPECT_NEAR(std::pow(r1 / r0, x) + std::pow(r2 / r0, x), 1.0, 1e-12);
    const Vector3 d = (branches[i].to - branches[i].from).normalized();
    const Vector3 d1 = (next[0]->to - next[0]->from).normalized(),
                  d2 = (next[1]->to - next[1]->from).normalized();
    EXPECT_NEAR(std::acos(d.dot(d1)), branchAngle(r0, r1, r2), 1e-7);
    EXPECT_NEAR(std::acos(d.dot(d2)), branchAngle(r0, r2, r1), 1e-7);
    EXPECT_NEAR(d.dot(d1.cross(d2)), 0, 1e-12) << "all three in one plane";
    EXPECT_EQ(branches[i].ends, next[0]->ends + next[1]->ends);
  }
  EXPECT_EQ(forks, 3);
}

TEST(Tree, SignsGrowWhatTheySay) {
  EXPECT_EQ(growTree(twice()).size(), 15u);
  TreeSpec spec;
  spec.axiom = "FFF[F][F]";
  const auto three = growTree(spec);
  ASSERT_EQ(three.size(), 3u);
  EXPECT_NEAR((three[0].to - three[0].from).norm(), 3 * 12 * 0.001, 1e-12);
  spec.axiom = "F[F]F";
  EXPECT_EQ(growTree(spec).size(), 3u);
  spec.axiom = "F[F][F][F]";
  EXPECT_NE(messageOf(spec).find("three branches"), std::string::npos);
  for (const char* bad : {"", "[", "F]", "A", "[F][F]", "F+", "f"}) {
    spec.axiom = bad;
    EXPECT_NE(messageOf(spec), "") << bad;
  }
  spec = twice();
  spec.steps = 12;
  EXPECT_NE(messageOf(spec), "") << "too many";
}

TEST(Tree, TheSameSeedScattersAlikeAndThinBranchesEndTheTree) {
  TreeSpec spec = twice();
  spec.scatter = 0.3;
  const auto a = growTree(spec), b = growTree(spec);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].to, b[i].to);
  spec.seed = 2;
  EXPECT_NE(growTree(spec).back().to, a.back().to);
  spec.least = 0.0012;
  const auto thick = growTree(spec);
  EXPECT_LT(thick.size(), a.size());
  EXPECT_EQ(thick[0].ends, 8u) << "the flow of what is not drawn is there";
  for (const TreeBranch& branch : thick) EXPECT_TRUE(!branch.drawn || branch.radius >= 0.0012);
}

TEST(Tree, ABranchIsATubeOfItsNetTiedToTheOneBefore) {
  const auto scene = bakeText(kSource);
  ASSERT_EQ(scene.objects.size(), 7u);
  std::set<std::string> tied;
  for (const auto& c : scene.connections) tied.insert(c.object0 + " " + c.object1);
  for (const char* pair : {"tree_2 tree_1", "tree_5 tree_1", "tree_3 tree_2", "tree_4 tree_2"})
    EXPECT_EQ(tied.count(pair), 1u) << pair;
  EXPECT_EQ(tied.size(), 6u);
  for (const auto& object : scene.objects) {
    EXPECT_EQ(object.tube.vessel_segment, object.name);
    EXPECT_GE(object.tube.rings.size(), 4u);
  }
  const auto held = [](const vest::scene::Object& o) {
    return std::count(o.fixed.begin(), o.fixed.end(), 1);
  };
  EXPECT_GT(held(scene.objects[0]), 0);
  for (std::size_t i = 1; i < 7; ++i)
    EXPECT_EQ(held(scene.objects[i]), 0) << "rings are held at the root alone";
  ASSERT_EQ(scene.vessels.size(), 1u);
  EXPECT_EQ(scene.vessels[0].supply, "uterine_branches_left");
  EXPECT_NE(scene.vessels[0].network_csv.find("\n2,tree_2,2,3,"), std::string::npos)
      << scene.vessels[0].network_csv;
}

TEST(Tree, ASceneKeepsItsTreesAndTheirBytesBelongToTheHash) {
  const vest::test::TemporaryScene folder;
  const auto baked = bakeText(kSource);
  writeScene(baked, folder.folder(), "source.yaml", kSource);
  const auto loaded = vest::scene::loadScene(folder.folder() + "/twig.yaml");
  ASSERT_EQ(loaded.vessels.size(), 1u);
  EXPECT_EQ(loaded.vessels[0].network_csv, baked.vessels[0].network_csv);
  EXPECT_EQ(loaded.vessels[0].case_json, baked.vessels[0].case_json);
  EXPECT_EQ(loaded.vessels[0].supply, "uterine_branches_left");
  folder.write("tree/inflow.csv", baked.vessels[0].inflow_csv + "\n");
  EXPECT_NE(vest::scene::loadScene(folder.folder() + "/twig.yaml").hash, loaded.hash);
  vest::scene::World world(loaded);
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  for (int i = 0; i < 200; ++i) {
    input.dt = 1e-3;
    input.step = world.steps();
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok);
  }
  // Two dozen ties share the few knots of a branch's end. Bounded each by itself they threw it at 6 m/s.
  EXPECT_LT(vest::specimen::fastestKnot(world), 0.001) << "m/s: branches stay where they grew";
}

TEST(Tree, MistakesAreNamedWithTheirLine) {
  const auto says = [](const std::string& from, const std::string& to, const std::string& part) {
    std::string text = kSource;
    text.replace(text.find(from), from.size(), to);
    try {
      bakeText(text);
      ADD_FAILURE() << part;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  says("axiom: A", "axiom: f", "source.yaml:9: objects[0].tree.axiom: f: must be 1 to 200 of the letters");
  says("steps: 3", "steps: 12", "source.yaml:4: objects[0]");
  says("    support: 25\n", "    support: 25\n    vessel_segment: aorta\n", "vessel_segment");
  says("fixed: [{rings: [0, 1]}]", "connect: [{to: tree_9, rings: [0, 1], within: 1, stiffness: 1}]",
       "refers to tree_9");
  says("name: tree", "name: a_name_of_a_tree_that_is_much_longer_than_forty", "at most 40 signs");
}

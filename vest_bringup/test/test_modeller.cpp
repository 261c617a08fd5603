#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "play.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/modelling/session.h"

// Protects what drawing is for: organs that are drawn by edits live in a scene with all effects. A tree of
// vessels that is drawn bleeds where it is cut, and nobody entered it twice.

namespace vest::simulation {
namespace {

const std::string kStart = "# Drawn by edits.\nvest_source: 1\nname: drawn\ninclude:\n  - {part: hollow}\n";

struct Folder {
  std::string path;
  Folder() {
    char pattern[] = "/tmp/vest_modeller_XXXXXX";
    path = mkdtemp(pattern);
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

modelling::Session drawn() {
  const std::string database = ros::package::getPath("vest_tissue") + "/data/materials.yaml";
  modelling::Session s("source.yaml", kStart, modelling::readMaterials(database));
  // Serosa, muscle, mucosa: materials stand in for those that the database does not have.
  s.apply("set", "/objects", R"([{name: bowel, organ: intestine, material: intestine,
    tube: {centre: [[-0.05, 0.098, 0.06], [0, 0.1, 0.06], [0.05, 0.098, 0.06]], reference: [0, 0, 1],
           rings: 15, around: 8, start: cap, end: cap, sections: [{at: 0, radii: [0.008]}]},
    layers: [{material: peritoneum, thickness: 0.0005}, {material: intestine, thickness: 0.001},
             {material: fat_soft, thickness: 0.0007}],
    fixed: [{rings: [0, 0]}, {rings: [-1, -1]}]}])");
  s.apply("insert", "/objects/-",
          R"({name: tree, organ: artery, material: artery, support: 25, bulk_modulus: 200,
    tree: {root: [-0.0208, 0.0158, 0.055], direction: [0.0208, 0.0342, 0], plane: [1, 0, 0], radius: 0.0025,
           axiom: "FFFF[F][F]", length: 7, supply: uterine_branches_left},
    fixed: [{rings: [0, 1]}]})");
  std::vector<std::string> reached;
  for (const auto& near : s.propose("tree_3", 0.012)) reached.push_back(near.to);
  EXPECT_EQ(std::count(reached.begin(), reached.end(), "bowel"), 1) << "what lies near is proposed";
  s.apply("set", "/objects/tree/connect",
          "[{to: bowel, rings: [-2, -1], per_ring: 2, within: 0.012, stiffness: 10}]");
  return s;
}

TEST(Modeller, ADrawnTreeIsCutAndBleedsAndTheSavedSceneHasTheSameHash) {
  const modelling::Session session = drawn();
  const Folder first, second;
  const std::string file = modelling::save(session, first.path);
  const scene::Description description = scene::loadScene(file);

  // Read again from what was saved, and saved again: the same bytes.
  const std::string source = first.path + "/source.yaml";
  const modelling::Session again(
      source, scene::yaml::readFile(source, 1u << 20),
      modelling::readMaterials(ros::package::getPath("vest_tissue") + "/data/materials.yaml"));
  EXPECT_EQ(again.hash(), session.hash());
  EXPECT_EQ(scene::loadScene(modelling::save(again, second.path)).hash, description.hash);

  const kinematics::TrainerBox box = testBox();
  const trajectory::Trajectory script = trajectory::fromWaypoints(
      ros::package::getPath("vest_bringup") + "/trajectories/arterial_bleeding.yaml", box);
  Stage stage = makeStage(scene::World(description), sessionEffects(true, script));
  int cuts = 0;
  double lost = 0, before = -1;
  const RehearsalReport report =
      rehearse(*stage.trainer, box, script, handsOf(script), 5.0,
               [&](double, const scene::StepInput&, const scene::StepReport& told) {
                 for (const scene::Event& event : told.events) {
                   if (event.kind != scene::EventKind::Cut) continue;
                   EXPECT_EQ(description.objects[event.object].name, "tree_1");
                   if (cuts++ == 0) before = lost;  // until the step before
                 }
                 lost = stage.blood->circulation().lost;
               });
  EXPECT_NE(report.worst, scene::Status::Fault);
  std::printf("%d cuts, %.3g ml lost\n", cuts, 1e6 * lost);
  EXPECT_GT(cuts, 0);
  EXPECT_EQ(before, 0.0) << "nothing bleeds before it is cut";
  EXPECT_GT(lost, 1e-7) << "m3";
  EXPECT_GT(stage.field->fluid().emitted, 0.5 * lost) << "what is lost is seen";
}

// A branch that somebody drew is an artery like those of the scenes: it is seen to beat.
TEST(Modeller, ADrawnTreePulsesAsItsElasticitySays) {
  const Folder folder;
  const scene::Description description = scene::loadScene(modelling::save(drawn(), folder.path));
  const kinematics::TrainerBox box = testBox();
  const trajectory::Trajectory script = trajectory::fromWaypoints(
      ros::package::getPath("vest_bringup") + "/trajectories/arterial_bleeding.yaml", box);
  Stage stage = makeStage(scene::World(description), sessionEffects(true, script));

  struct Swing {
    double least = 1e9, most = 0;
    void add(double x) { least = std::min(least, x), most = std::max(most, x); }
    double of() const { return most / least - 1; }
  };
  struct Branch {
    std::size_t object;
    int vessel;
    std::size_t ring;
    Swing seen, said;
  };
  std::vector<Branch> branches;
  for (std::size_t i = 0; i < description.objects.size(); ++i) {
    const scene::Object& o = description.objects[i];
    if (o.name.rfind("tree_", 0) != 0 || o.name == "tree_1") continue;  // the scissors go to the stem
    branches.push_back(
        {i, stage.blood->model().find(o.tube.vessel_segment), o.tube.rings.size() / 2, {}, {}});
    EXPECT_GE(branches.back().vessel, 0) << o.name;
  }
  ASSERT_FALSE(branches.empty());
  const RehearsalReport report = rehearse(
      *stage.trainer, box, script, handsOf(script), 2.2,  // nothing is cut yet
      [&](double t, const scene::StepInput&, const scene::StepReport&) {
        if (t < 1.0) return;  // the scene settles; what is left is more than a beat
        for (Branch& b : branches) {
          const auto& knots = description.objects[b.object].tube.rings.at(b.ring);
          const scene::World& world = stage.trainer->world();
          Eigen::Vector3d middle = Eigen::Vector3d::Zero();
          double radius = 0;
          for (const auto k : knots) middle += world.knotAt(b.object, k) / static_cast<double>(knots.size());
          for (const auto k : knots)
            radius += (world.knotAt(b.object, k) - middle).norm() / static_cast<double>(knots.size());
          b.seen.add(radius);
          b.said.add(
              haemodynamics::dilatation(stage.blood->model(), stage.blood->circulation(), b.vessel, 0.5));
        }
      });
  EXPECT_NE(report.worst, scene::Status::Fault);
  EXPECT_EQ(stage.blood->circulation().lost, 0.0) << "whole";
  EXPECT_GT(stage.blood->circulation().heart_rate * 1.2, 1.0) << "a whole beat was watched";
  for (const Branch& b : branches) {
    SCOPED_TRACE(description.objects[b.object].name);
    std::printf("%s: radius %.4f mm swings by %.3f %%, its wall says %.3f %%\n",
                description.objects[b.object].name.c_str(), 1e3 * b.seen.least, 100 * b.seen.of(),
                100 * b.said.of());
    EXPECT_GT(b.said.of(), 1e-3) << "the pressure goes up and down";
    EXPECT_GT(b.seen.of(), 0.8 * b.said.of());
    EXPECT_LT(b.seen.of(), 1.25 * b.said.of());
  }
}

}  // namespace
}  // namespace vest::simulation

// Protects scenes with an image: what is read, what is refused, and that a World feels it as the law says, to
// the same bits after a snapshot and on any number of threads.
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "vest_tissue/scene/world.h"
#include "vest_tissue/voxel/volume.h"

using namespace vest;
using Eigen::Vector3d;

namespace {

namespace fs = std::filesystem;

/// The needle's way of spine_puncture: from the right trocar to the disc.
const Vector3d kPivot(0.115, -0.020, 0.165), kDisc(0, 0.050, 0.040);

struct Insertion {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  std::vector<std::pair<scene::EventKind, std::string>> events;

  explicit Insertion(const scene::Description& d, int threads = 1) : world(d, threads) {
    scene::ToolInput& tool = input.tools[1];
    tool.present = true;
    tool.tool = tools::ToolKind::InjectionNeedle;
    tool.pivot = kPivot;
    tool.orientation = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), kDisc - kPivot);
  }
  /// The tip's frame, m from the pivot; the needle's point is 20 mm beyond.
  void go(double from, double to, int steps) {
    for (int i = 1; i <= steps; ++i) {
      const double at = from + (to - from) * i / steps;
      input.tools[1].position = kPivot + at * (kDisc - kPivot).normalized();
      input.step = world.steps() + 1;
      world.step(input, report);
      for (const scene::Event& e : report.events)
        events.emplace_back(e.kind, world.description().objects[e.object].name);
    }
  }
  bool told(scene::EventKind kind, const char* name) const {
    return std::find(events.begin(), events.end(), std::make_pair(kind, std::string(name))) != events.end();
  }
};

const scene::Description& spine() {
  static const scene::Description d =
      scene::loadScene(VEST_TISSUE_SCENES "/spine_puncture/spine_puncture.yaml");
  return d;
}

/// What loadScene says of an `image:`; empty: it is taken.
std::string refusal(const std::string& image) {
  const fs::path folder = fs::temp_directory_path() / ("vest_test_image_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "four.raw") << "12345678";
  fs::copy_file(VEST_TISSUE_SCENES "/spine_puncture/needle.csv", folder / "needle.csv",
                fs::copy_options::overwrite_existing);
  std::ofstream(folder / "scene.yaml") << "vest_scene: 1\nname: scene\nimage:\n" << image;
  std::string why;
  try {
    scene::loadScene((folder / "scene.yaml").string());
  } catch (const std::invalid_argument& error) {
    why = error.what();
  }
  fs::remove_all(folder);
  return why;
}

void refuses(const std::string& image, const std::string& word) {
  const std::string why = refusal(image);
  EXPECT_NE(why.find(word), std::string::npos) << image << "says: " << why;
}

}  // namespace

TEST(FeltScene, TheNeedlePassesEachLayerAndTheWorldTellsItsForce) {
  Insertion needle(spine());
  needle.go(0.030, 0.100, 3500);
  EXPECT_TRUE(needle.told(scene::EventKind::Punctured, "skin"));
  EXPECT_TRUE(needle.told(scene::EventKind::Punctured, "muscle"));
  const scene::ContactModel& m = needle.report.contacts[1];
  EXPECT_TRUE(m.in_contact);
  EXPECT_TRUE(m.image_alone);
  EXPECT_GT(-m.wrench.head<3>().dot((kDisc - kPivot).normalized()), 0.5) << "N against the way";
  EXPECT_EQ(m.wrench.head<3>(), m.image);
  needle.go(0.100, 0.158, 4000);
  EXPECT_TRUE(needle.told(scene::EventKind::Punctured, "disc"));
  EXPECT_FALSE(needle.told(scene::EventKind::Punctured, "canal"));
  EXPECT_FALSE(needle.told(scene::EventKind::Punctured, "vertebra"));
  needle.go(0.158, 0.030, 6000);
  EXPECT_TRUE(needle.told(scene::EventKind::Exited, "skin"));
  EXPECT_EQ(needle.report.contacts[1].wrench.norm(), 0.0);
}

TEST(FeltScene, ASnapshotInTheMiddleOfAnInsertionGoesOnToTheSameBits) {
  Insertion one(spine()), other(spine(), 3);
  one.go(0.030, 0.110, 2000);
  other.go(0.030, 0.110, 2000);
  EXPECT_EQ(one.world.stateHash(), other.world.stateHash());
  std::vector<std::uint8_t> bytes;
  one.world.save(bytes);
  one.go(0.110, 0.130, 500);
  other.world.reset();
  EXPECT_NE(one.world.stateHash(), other.world.stateHash());
  other.world.restore(bytes);
  other.go(0.110, 0.130, 500);
  EXPECT_EQ(one.world.stateHash(), other.world.stateHash());
  EXPECT_EQ(one.report.contacts[1].wrench, other.report.contacts[1].wrench);
}

TEST(FeltScene, WhatIsWrongIsNamed) {
  const std::string small =
      "  phantom: head\n  low: [0, 0, 0]\n  high: [0.01, 0.01, 0.01]\n  table: needle.csv\n";
  EXPECT_EQ(refusal(small), "");
  refuses("  table: needle.csv\n", "phantom, file");
  refuses(small + "  regions: [{name: disc}]\n", "skull");
  refuses(small + "  regions: [{name: skull}, {name: skull}]\n", "once");
  refuses(small + "  size: [1, 2, 2]\n", "belongs to file");
  const std::string file =
      "  file: four.raw\n  axes: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n  origin: [0, 0, 0]\n"
      "  table: needle.csv\n  size: ";
  refuses(file + "[2, 2, 2]\n", "must have 16 bytes");
  refuses(
      "  file: four.raw\n  axes: [[1, 0, 0], [1, 0, 0], [0, 0, 1]]\n  origin: [0, 0, 0]\n  table: "
      "needle.csv\n"
      "  size: [2, 2, 1]\n",
      "span a volume");
}

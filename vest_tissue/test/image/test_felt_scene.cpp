// Protects the way from a CT to a scene that is felt (vest_import feel): what is written loads, lies below
// the trocars, and keeps the values.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "vest_tissue/image/felt_scene.h"
#include "vest_tissue/image/phantom.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/voxel/volume.h"

using namespace vest;

namespace {

namespace fs = std::filesystem;

struct Folder {
  fs::path path = fs::temp_directory_path() / ("my_needle_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
};

image::Volume head() {
  image::PhantomImage options;
  options.size = {50, 60, 40};
  return image::picture(image::makePhantom("head"), options);
}

}  // namespace

TEST(FeltImages, AHeadBecomesASceneWithItsSkinBelowTheTrocars) {
  const Folder folder;
  const auto scene = scene::loadScene(image::writeFeltScene(head(), folder.path.string()));
  ASSERT_TRUE(scene.feel);
  const voxel::View view = scene.feel->view();
  EXPECT_LT(voxel::sampleValue(view, {0, 0.05, 0.125}).value, -700) << "air above";
  EXPECT_GT(voxel::sampleValue(view, {0, 0.05, 0.090}).value, -100) << "the head";
  ASSERT_EQ(scene.regions.size(), 2u);
  EXPECT_EQ(scene.objects[scene.regions[1]].name, "bone");
  EXPECT_FALSE(scene.objects[scene.regions[1]].skin.triangles.empty());
  EXPECT_NO_THROW(scene::World{scene});
}

TEST(FeltImages, ASceneThatItsReaderRefusesLeavesNoFile) {
  const Folder folder;
  const std::string table = folder.path.string() + "/mine.csv";
  std::ofstream(table) << "value,nothing\n0,1\n";
  std::string message;
  try {
    image::writeFeltScene(head(), folder.path.string(), table,
                          [](const std::string& scene) { scene::loadScene(scene); });
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  EXPECT_EQ(message.rfind(table + ":", 0), 0u) << "the table that was given: " << message;
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder.path)) files += entry.path() != table;
  EXPECT_EQ(files, 0u);
}

TEST(FeltImages, ValuesWithoutAUnitNeedATableOfTheirOwn) {
  const Folder folder;
  image::Volume mr = head();
  mr.unit.clear();
  std::string message;
  try {
    image::writeFeltScene(mr, folder.path.string());
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  EXPECT_NE(message.find("give one by --table"), std::string::npos) << message;
  EXPECT_EQ(message.find(mr.slices.front().file), 0u) << "the images: " << message;
}

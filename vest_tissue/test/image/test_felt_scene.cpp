// Protects the way from a CT to a scene that is felt (vest_import feel): what is written loads, lies below
// the trocars, and keeps the values.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

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

TEST(FeltImages, ValuesWithoutAUnitNeedATableOfTheirOwn) {
  const Folder folder;
  image::Volume mr = head();
  mr.unit.clear();
  EXPECT_THROW(image::writeFeltScene(mr, folder.path.string()), std::invalid_argument);
}

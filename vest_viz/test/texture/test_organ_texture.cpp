#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "vest_viz/texture/kept_texture.h"
#include "vest_viz/texture/noise.h"
#include "vest_viz/texture/organ_texture.h"

namespace vest::texture {
namespace {

TEST(Noise, RepeatsAfterOneTile) {
  for (float u : {0.0f, 0.13f, 0.77f})
    for (float v : {0.02f, 0.5f}) {
      EXPECT_NEAR(periodicFbm(u, v, 3, 5, 4, 9), periodicFbm(u + 1, v, 3, 5, 4, 9), 1e-3);
      EXPECT_NEAR(periodicFbm(u, v, 3, 5, 4, 9), periodicFbm(u, v + 1, 3, 5, 4, 9), 1e-3);
      EXPECT_NEAR(periodicCell(u, v, 7, 2).nearest, periodicCell(u + 1, v + 1, 7, 2).nearest, 1e-3);
    }
}

TEST(Noise, TurbulenceIsNeverNegative) {
  for (int i = 0; i < 200; ++i) EXPECT_GE(periodicTurbulence(i / 200.0f, 0.3f, 4, 4, 4, 1), 0.0f);
}

double meanOf(const Baked& b, int channel) {
  double sum = 0;
  for (std::size_t i = static_cast<std::size_t>(channel); i < b.albedo.size(); i += 4) sum += b.albedo[i];
  return 4 * sum / static_cast<double>(b.albedo.size());
}

TEST(OrganTexture, BakingTwiceGivesTheSamePicture) {
  const Baked a = bake(styleOf("tube"), 64, 3), b = bake(styleOf("tube"), 64, 3);
  EXPECT_EQ(a.albedo, b.albedo);
  EXPECT_EQ(a.relief, b.relief);
}

TEST(OrganTexture, AKeptPictureIsTheBakedOneAndADamagedFileIsMadeAgain) {
  namespace fs = std::filesystem;
  std::string folder = (fs::temp_directory_path() / "vest_textures_XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const Baked baked = bake(styleOf("tube"), 64, 3);
  const auto file = [&] { return fs::directory_iterator(folder)->path(); };
  bakeKept(styleOf("tube"), 64, 3, folder);
  const auto first_written = fs::last_write_time(file());
  const Baked kept = bakeKept(styleOf("tube"), 64, 3, folder);
  EXPECT_EQ(fs::last_write_time(file()), first_written) << "read, not made again";
  EXPECT_EQ(kept.albedo, baked.albedo);
  EXPECT_EQ(kept.relief, baked.relief);
  EXPECT_EQ(kept.tile, baked.tile);
  {
    std::fstream damage(file(), std::ios::in | std::ios::out | std::ios::binary);
    damage.seekp(5000);
    damage.put('x').put('y').put('z');
  }
  EXPECT_EQ(bakeKept(styleOf("tube"), 64, 3, folder).albedo, baked.albedo);
  EXPECT_EQ(bakeKept(styleOf("tube"), 32, 3, folder).size, 32) << "another size is another picture";
  Style other = styleOf("tube");
  other.base[0] *= 0.5f;
  EXPECT_EQ(bakeKept(other, 64, 3, folder).albedo, bake(other, 64, 3).albedo) << "so is another style";
  fs::remove_all(folder);
  EXPECT_EQ(bakeKept(styleOf("tube"), 64, 3, "/proc/none").albedo, baked.albedo) << "nowhere to keep it";
}

TEST(OrganTexture, OrgansHaveTheirColours) {
  const Baked ovary = bake(styleOf("ovary"), 64, 3), artery = bake(styleOf("artery"), 64, 3),
              vein = bake(styleOf("vein"), 64, 3);
  EXPECT_GT(meanOf(ovary, 1), 1.7 * meanOf(artery, 1));  // whitish against red
  EXPECT_GT(meanOf(artery, 0), 1.3 * meanOf(vein, 0));   // bright against dark
  EXPECT_GT(meanOf(vein, 2), meanOf(vein, 1));           // bluish
  const Baked gallbladder = bake(styleOf("gallbladder"), 64, 3), liver = bake(styleOf("liver"), 64, 3);
  EXPECT_GT(meanOf(gallbladder, 1) / meanOf(gallbladder, 0), 0.85);  // bile shines through
  EXPECT_GT(meanOf(gallbladder, 1), 1.6 * meanOf(liver, 1));         // pale against brown red
  EXPECT_GT(meanOf(liver, 0), 2 * meanOf(liver, 2));
  const Baked omentum = bake(styleOf("omentum"), 64, 3);
  EXPECT_GT(meanOf(omentum, 1), 1.3 * meanOf(omentum, 2));  // yellow
  const Baked bone = bake(styleOf("bone"), 64, 3), cartilage = bake(styleOf("cartilage"), 64, 3);
  EXPECT_GT(meanOf(bone, 1) / meanOf(bone, 0), 0.8);  // ivory, no flesh
  EXPECT_GT(meanOf(cartilage, 2), meanOf(bone, 2));
  for (const char* organ :
       {"uterus", "tube", "ovary", "ligament", "artery", "vein", "intestine", "cavity", "unheard of"}) {
    const Baked b = bake(styleOf(organ), 64, 3);
    EXPECT_GT(meanOf(b, 0), meanOf(b, 1)) << organ;
    EXPECT_GT(meanOf(b, 0), meanOf(b, 2)) << organ;
  }
}

TEST(OrganTexture, TilesWithoutASeam) {
  // Steps across the border are no larger than the largest step inside.
  const int n = 256;
  const Baked b = bake(styleOf("cavity"), n, 3);
  const auto step = [&](int x0, int x1) {
    double sum = 0;
    for (int y = 0; y < n; ++y)
      sum +=
          std::abs(int(b.albedo[4 * std::size_t(y * n + x0)]) - int(b.albedo[4 * std::size_t(y * n + x1)]));
    return sum / n;
  };
  double largest = 0;
  for (int x = 0; x + 1 < n; ++x) largest = std::max(largest, step(x, x + 1));
  EXPECT_LE(step(n - 1, 0), 1.05 * largest);
}

TEST(OrganTexture, ReliefHasNoMeanSlopeAndDoesNotClip) {
  for (const char* organ : {"uterus", "cavity", "ovary"}) {
    const Baked b = bake(styleOf(organ), 256, 3);
    double sum = 0;
    int clipped = 0;
    for (std::size_t i = 0; i < b.relief.size(); i += 4) {
      sum += b.relief[i] - 127.5;
      clipped += b.relief[i] == 0 || b.relief[i] == 255;
    }
    EXPECT_NEAR(4 * sum / static_cast<double>(b.relief.size()), 0.0, 1.0) << organ;
    EXPECT_LT(4.0 * clipped / static_cast<double>(b.relief.size()), 0.02) << organ;
  }
}

}  // namespace
}  // namespace vest::texture

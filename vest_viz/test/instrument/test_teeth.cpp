// Teeth that pixels are too large for are left out; else the seam of closed jaws is a row of dots.
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <ros/package.h>

#include "vest_viz/instrument/stl.h"
#include "vest_viz/instrument/teeth.h"

namespace vest::instrument {
namespace {

TriangleMesh jaw(const std::string& tool) {
  return readStl(ros::package::getPath("vest_instruments") + "/meshes/" + tool + "_jaw_left.stl", 0.6);
}

// m: how far the inner face goes to and fro over the middle of the jaw.
float depth(const TriangleMesh& mesh) {
  float least = 1, most = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); v += 3) {
    const float x = std::fabs(mesh.positions[v]), z = mesh.positions[v + 2];
    if (x < 0.00036f && z > 0.006f && z < 0.009f) least = std::min(least, x), most = std::max(most, x);
  }
  return most - least;
}

TEST(Teeth, FilledTheFaceIsEvenAndTheBackIsAsItWas) {
  for (const char* tool : {"grasper", "needle_holder"}) {
    const TriangleMesh whole = jaw(tool), smooth = toothless(whole);
    EXPECT_GT(depth(whole), 0.0001f) << tool;
    EXPECT_LT(depth(smooth), 0.00002f) << tool;
    ASSERT_EQ(smooth.positions.size(), whole.positions.size());
    EXPECT_EQ(smooth.triangles, whole.triangles);
    for (std::size_t v = 0; v < whole.positions.size(); v += 3) {
      // Closed jaws still meet at the plane x = 0, and do not pass through each other.
      EXPECT_LE(std::fabs(smooth.positions[v]), std::fabs(whole.positions[v]));
      EXPECT_GE(smooth.positions[v] * whole.positions[v], -1e-12f);
      if (std::fabs(whole.positions[v]) > 0.0005f) {
        EXPECT_EQ(smooth.positions[v], whole.positions[v]);
      }
      EXPECT_NEAR(std::hypot(smooth.normals[v], smooth.normals[v + 1], smooth.normals[v + 2]), 1, 1e-4);
    }
  }
}

TEST(Teeth, AreShownWherePixelsAreFine) {
  EXPECT_EQ(teethShown(0.00028), 0);  // 8 cm before the lens at the coarsest level of the live view
  EXPECT_EQ(teethShown(0.00008), 1);  // there at the finest
  const float half = teethShown(0.00012);
  EXPECT_GT(half, 0);
  EXPECT_LT(half, 1);
  const TriangleMesh whole = jaw("grasper"), smooth = toothless(whole);
  EXPECT_NEAR(depth(between(smooth, whole, half)), half * depth(whole), 0.00002);
}

}  // namespace
}  // namespace vest::instrument

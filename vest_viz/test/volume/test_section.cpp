// Protects slices: every pixel has the value of its place, in axis planes and in oblique ones; window and
// level as DICOM has them.
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "vest_viz/volume/section.h"

namespace {

using namespace vest::volume;
using Eigen::Vector3d;

/// Values are linear in the world: trilinear interpolation is exact.
double valueAt(const Vector3d& p) {
  return 100 + 2e3 * p.x() - 3e3 * p.y() + 5e3 * p.z();
}

Brick linear() {
  Brick b;
  b.size = {30, 20, 11};
  b.axes << 1e-3, 0, 0.2e-3, 0, 0, 3e-3, 0, -1.5e-3, 0.1e-3;  // turned, sheared
  b.origin = {-0.01, 0.02, 0.03};
  b.slope = 0.01, b.intercept = 50;
  for (int k = 0; k < 11; ++k)
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 30; ++i)
        b.stored.push_back(static_cast<std::int16_t>(
            std::lround((valueAt(b.origin + b.axes * Vector3d(i, j, k)) - b.intercept) / b.slope)));
  return b;
}

TEST(Section, HasAtEachPixelTheValueOfItsPlace) {
  const Brick b = linear();
  const Vector3d middle = b.origin + b.axes * Vector3d(14.5, 9.5, 5);
  for (const Vector3d& normal :
       {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1), Vector3d(0.6, -0.48, 0.64)}) {
    const vest::inspect::Plane plane{normal.cast<float>(), static_cast<float>(normal.dot(middle))};
    const Section s = section(b, plane, {100, 256});
    ASSERT_GT(s.width * s.height, 100) << normal;
    EXPECT_LT(std::abs(normal.dot(s.corner - middle)), 1e-6) << "lies in the plane";
    EXPECT_NEAR(s.right.dot(normal), 0, 1e-9);
    EXPECT_LE(s.down.z(), 1e-12) << "down is down";
    int seen = 0;
    for (int y = 0; y < s.height; ++y)
      for (int x = 0; x < s.width; ++x) {
        const std::uint8_t* const p = &s.rgba[4 * static_cast<std::size_t>(y * s.width + x)];
        const Vector3d place = s.corner + (x + 0.5) * s.right + (y + 0.5) * s.down;
        const Vector3d grid = b.axes.inverse() * (place - b.origin);
        bool among_centres = true, outside = false;
        for (int a = 0; a < 3; ++a) {
          among_centres = among_centres && grid[a] > 0 && grid[a] < b.size[a] - 1;
          outside = outside || grid[a] < -0.51 || grid[a] > b.size[a] - 0.49;
        }
        if (outside) {
          ASSERT_EQ(p[3], 0);
        }
        if (!among_centres) continue;
        ++seen;
        ASSERT_EQ(p[3], 255);
        ASSERT_NEAR(p[0], valueAt(place) + 28, 0.55) << x << " " << y << " normal " << normal;
      }
    EXPECT_GT(seen, 100);
  }
}

TEST(Section, IsEmptyBesideTheVolume) {
  EXPECT_EQ(section(linear(), {{1, 0, 0}, 1.0f}, {}).width, 0);
}

TEST(Section, HasNoMorePixelsThanAllowed) {
  const Section s = section(linear(), {{0, 0, 1}, 0.02f}, {}, 9);
  EXPECT_EQ(std::max(s.width, s.height), 9);
}

TEST(Section, WindowAndLevelAreThoseOfDicom) {
  // PS3.3, C.11.2.1.2.1: c = 2048, w = 4096 show 0 … 4095 as they are.
  const Window all{2048, 4096};
  EXPECT_EQ(grey(0, all), 0);
  EXPECT_EQ(grey(4095, all), 255);
  EXPECT_EQ(grey(1606, all), 100);
  EXPECT_EQ(grey(-500, all), 0);
  EXPECT_EQ(grey(9000, all), 255);
  EXPECT_EQ(grey(99, {100, 1}), 0);
  EXPECT_EQ(grey(100, {100, 1}), 255);
}

}  // namespace

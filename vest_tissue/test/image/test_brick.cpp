// Protects the way of an image into the world: every value lies where the patient's is, padding stays
// nothing, a large volume is reduced without moving, and the hash tells images apart.
#include <gtest/gtest.h>
#include <Eigen/LU>

#include "phantom_files.h"
#include "vest_tissue/image/brick.h"

namespace {

using namespace vest::image;
using vest::volume::Brick;

const Eigen::Vector3d kPlace(0.01, 0.05, 0.03);

std::shared_ptr<const float> realOf(const Volume& v, float scale) {
  auto values = std::make_shared<std::vector<float>>();
  for (std::size_t i = 0; i < v.voxels(); ++i) values->push_back(scale * static_cast<float>(v.value(i)));
  return {values, values->data()};
}

TEST(Brick, LiesSupineOnItsPlaceWithEveryValue) {
  const Volume head = vest::test::headOf(24, 8);
  const Brick brick = toBrick(head, kPlace);
  ASSERT_EQ(brick.size, head.size);
  for (std::size_t v = 0; v < head.voxels(); ++v) ASSERT_EQ(brick.value(brick.stored[v]), head.value(v)) << v;
  EXPECT_TRUE(brick.axes.isApprox(supine() * head.axes));
  EXPECT_GT((supine() * Eigen::Vector3d::UnitX()).dot(-Eigen::Vector3d::UnitX()), 0.99) << "left is at -x";
  EXPECT_GT((supine() * Eigen::Vector3d::UnitY()).dot(-Eigen::Vector3d::UnitZ()), 0.99)
      << "the back is below";
  const Eigen::Vector3d half(0.5 * head.size[0], 0.5 * head.size[1], 0.5 * head.size[2]);
  const Eigen::Vector3d middle = brick.origin + brick.axes * (half - Eigen::Vector3d::Constant(0.5));
  EXPECT_NEAR(middle.x(), kPlace.x(), 1e-9);
  EXPECT_NEAR(middle.y(), kPlace.y(), 1e-9);
  EXPECT_NEAR(middle.z() - half[1] * head.spacing()[1], kPlace.z(), 1e-9);
}

TEST(Brick, SpreadsRealNumbersOverSixteenBits) {
  Volume head = vest::test::headOf(24, 8);
  head.real = realOf(head, 1e-3f);
  head.whole = nullptr;
  const Brick brick = toBrick(head, kPlace);
  const Statistics s = statistics(head);
  for (std::size_t v = 0; v < head.voxels(); ++v)
    ASSERT_NEAR(brick.value(brick.stored[v]), head.value(v), (s.max - s.min) / 65534) << v;
}

TEST(Brick, ReducesALargeVolumeWhereItLies) {
  const Volume head = vest::test::headOf(24, 8);
  const Brick whole = toBrick(head, kPlace), half = toBrick(head, kPlace, head.voxels());
  EXPECT_LE(2 * half.voxels(), head.voxels());
  EXPECT_EQ(half.stored.size(), half.voxels());
  double sum = 0, reduced = 0;
  for (const auto v : whole.stored) sum += v;
  for (const auto v : half.stored) reduced += v;
  EXPECT_NEAR(sum / static_cast<double>(whole.voxels()), reduced / static_cast<double>(half.voxels()), 20)
      << "HU";
  const auto corner = [](const Brick& b) {
    return Eigen::Vector3d(b.origin - b.axes * Eigen::Vector3d::Constant(0.5));
  };
  EXPECT_LT((corner(whole) - corner(half)).norm(), 1e-9);
}

TEST(Brick, KeepsPaddingAsNothing) {
  Volume head = vest::test::headOf(24, 8);
  for (Slice& s : head.slices) s.padding_low = -1100, s.padding_high = -950;
  const Brick brick = toBrick(head, kPlace);
  std::size_t nothing = 0;
  for (std::size_t v = 0; v < head.voxels(); ++v) {
    ASSERT_EQ(brick.stored[v] == Brick::kNothing, head.padding(v)) << v;
    nothing += head.padding(v);
  }
  EXPECT_GT(nothing, 100u);
}

TEST(Brick, TheHashTellsImagesApart) {
  const Volume head = vest::test::headOf(24, 8);
  Volume moved = head;
  moved.origin.x() += 1e-3;
  EXPECT_EQ(hash(head), hash(vest::test::headOf(24, 8)));
  EXPECT_NE(hash(head), hash(moved));
  EXPECT_NE(hash(head), hash(vest::test::headOf(24, 9)));
}

TEST(Brick, InterpolatesBetweenCentresAndLeavesNothingOut) {
  Brick brick;
  brick.size = {2, 1, 2};
  brick.stored = {0, 100, 200, Brick::kNothing};
  float number = -1;
  EXPECT_TRUE(interpolate(brick, {0.25f, 0, 0}, number));
  EXPECT_FLOAT_EQ(number, 25);
  EXPECT_TRUE(interpolate(brick, {-0.5f, 0.5f, -0.5f}, number)) << "constant outwards";
  EXPECT_FLOAT_EQ(number, 0);
  EXPECT_FALSE(interpolate(brick, {0.75f, 0, 0.75f}, number));
  EXPECT_TRUE(interpolate(brick, {0.25f, 0, 1}, number));
  EXPECT_FLOAT_EQ(number, 200) << "of what was measured alone";
}

}  // namespace

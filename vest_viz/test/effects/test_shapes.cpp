#include "vest_viz/effects/shapes.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "vest_viz/smoke/veil.h"

namespace vest::effects {
namespace {

using Eigen::Vector3d;

const float kNaN = std::numeric_limits<float>::quiet_NaN();

TEST(Tube, FollowsItsPointsAtItsRadiusAndClosesWhereAsked) {
  std::vector<float> ring;
  for (int i = 0; i < 24; ++i)
    for (float v : {0.005f * std::cos(i * 0.2618f), 0.005f * std::sin(i * 0.2618f), 0.01f}) ring.push_back(v);
  const instrument::TriangleMesh m = tube(ring.data(), 24, 0.0003, true);
  ASSERT_EQ(m.positions.size(), 3u * 24 * 8);
  ASSERT_EQ(m.triangles.size(), 3u * 24 * 8 * 2);
  for (std::size_t i = 0; i < m.positions.size(); i += 3) {
    const double r = std::hypot(m.positions[i], m.positions[i + 1]) - 0.005;
    EXPECT_NEAR(std::hypot(r, m.positions[i + 2] - 0.01), 0.0003, 2e-5);
  }
  EXPECT_GT(tube(ring.data(), 24, 0.0003, false).triangles.size(), 3u * 23 * 8 * 2) << "ends have caps";
  ring[4] = kNaN;
  EXPECT_TRUE(tube(ring.data(), 24, 0.0003, true).triangles.empty());
  EXPECT_TRUE(tube(nullptr, 0, 0.0003, true).triangles.empty());
}

TEST(Drops, AreDrawnOutAlongTheirMotionAndFainter) {
  const float p[] = {0, 0, 0.1f, 0.01f, 0, 0.1f, kNaN, 0, 0};
  const float v[] = {0, 0, 0, 0, 2.0f, 0, 0, 0, 0};
  Quads q;
  EXPECT_EQ(addDrops(p, v, nullptr, 3, 0.0005, Vector3d::Zero(), 0.01, &q), 1u) << "the NaN is left out";
  ASSERT_EQ(q.count(), 2u);
  const auto extent = [&](std::size_t quad, int axis) {
    float low = 1, high = -1;
    for (std::size_t k = 0; k < 4; ++k) {
      low = std::min(low, q.corners[12 * quad + 3 * k + static_cast<std::size_t>(axis)]);
      high = std::max(high, q.corners[12 * quad + 3 * k + static_cast<std::size_t>(axis)]);
    }
    return high - low;
  };
  EXPECT_NEAR(extent(0, 0), 0.001, 3e-4);
  EXPECT_NEAR(extent(1, 1), 0.02 + 0.001, 1e-3) << "2 m/s for 10 ms";
  EXPECT_LT(q.features[12], 0.5f * q.features[0]);
}

TEST(Pool, IsWetWhereItsCellsAreAndFadesAtItsBorder) {
  const float n = kNaN;
  const float h[] = {n, n, n, n, n, n, 1, 1, 1, n, n, 1, 1, 1, n, n, 1, 1, 1, n, n, n, n, n, n};
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Vector3d(1, 0, 0);
  const Pool pool = poolSurface(X, 0.01, 5, 5, h, 0.5);
  ASSERT_EQ(pool.positions.size() / 3, 25u) << "nine wet cells and the sixteen round them";
  int full = 0, dry = 0;
  for (std::size_t i = 0; i < pool.features.size(); i += 3) {
    EXPECT_FLOAT_EQ(pool.features[i], 0.5f);
    EXPECT_FLOAT_EQ(pool.positions[i + 2], 1) << "the border lies level with its neighbours";
    dry += pool.features[i + 1] == 0;
    if (pool.features[i + 1] < 1) continue;
    ++full;
    EXPECT_NEAR(pool.positions[i], 1.025, 1e-6);
    EXPECT_NEAR(pool.positions[i + 1], 0.025, 1e-6);
  }
  EXPECT_EQ(full, 1);
  EXPECT_EQ(dry, 16);
  EXPECT_TRUE(poolSurface(X, 0.0, 5, 5, h, 0.5).triangles.empty());
}

TEST(Puffs, ThinSmokeIsFainterAndNothingIsLeftOut) {
  Quads q;
  addPuff({0, 0, 0.1}, 0.01, 0.01, 0, 1, Vector3d::Zero(), &q);
  addPuff({0, 0, 0.1}, 0.01, 0.001, 0, 1, Vector3d::Zero(), &q);
  ASSERT_EQ(q.count(), 2u);
  EXPECT_NEAR(q.features[0], 1 - std::exp(-kSmokeExtinction * 0.01 * 0.02), 1e-6);
  EXPECT_NEAR(q.features[12], 1 - std::exp(-kSmokeExtinction * 0.001 * 0.02), 1e-6);
  addPuff({0, 0, 0.1}, kNaN, 0.001, 0, 1, Vector3d::Zero(), &q);
  addPuff({0, 0, 0.1}, 0.01, 0, 0, 1, Vector3d::Zero(), &q);
  EXPECT_EQ(q.count(), 2u);
}

TEST(Veil, IsThickWhereSmokeLiesBeforeTheTissueAndClearWhereTissueLiesBeforeIt) {
  const camera::Intrinsics source = camera::fromFieldOfView(160, 160, 1.2, {0, 0, 0, 0, 0});
  smoke::Field field;
  field.origin = Vector3d(-0.05, -0.05, 0.06);
  field.cell = 0.01;
  field.size[0] = field.size[1] = 10;
  field.size[2] = 4;
  field.scale = 0.02f;
  field.density.assign(400, 255);
  // Tissue at 15 cm on the left, at 3 cm on the right.
  const auto code = [](double z) { return static_cast<std::uint8_t>(255 * (1 - std::sqrt(z / 0.3))); };
  cv::Mat rendering(160, 160, CV_8UC4, cv::Scalar(100, 50, 50, code(0.15)));
  rendering(cv::Rect(80, 0, 80, 160)).setTo(cv::Scalar(100, 50, 50, code(0.03)));
  smoke::Veil veil;
  cv::Mat out;
  veil.draw(field, source, Eigen::Isometry3d::Identity(), rendering, 0, 0.0035, &out);
  ASSERT_EQ(out.cols, 20);
  EXPECT_GT(out.at<cv::Vec4b>(10, 6)[3], 60) << "4 cm of smoke at 20 g/m3";
  EXPECT_LT(out.at<cv::Vec4b>(10, 15)[3], 3);
  field.density.assign(400, 0);
  veil.draw(field, source, Eigen::Isometry3d::Identity(), rendering, 0, 0.0035, &out);
  EXPECT_TRUE(out.empty());
  field.density.resize(399);
  EXPECT_FALSE(field.valid());
}

}  // namespace
}  // namespace vest::effects

#include "vest_viz/truth/raster.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "vest_viz/truth/keypoints.h"

namespace vest::truth {
namespace {

using Eigen::Vector3d;

/// A bumpy sheet before the camera and a ball before the sheet.
struct Scene {
  std::vector<float> sheet, ball, sheet_before, ball_before;
  std::vector<std::uint32_t> sheet_triangles, ball_triangles;
  std::vector<Body> bodies() const {
    const auto body = [](std::uint16_t label, const std::vector<float>& p, const std::vector<float>& before,
                         const std::vector<std::uint32_t>& t) {
      return Body{label,        p.data(), before.empty() ? nullptr : before.data(),
                  p.size() / 3, t.data(), t.size() / 3};
    };
    return {body(7, sheet, sheet_before, sheet_triangles), body(3, ball, ball_before, ball_triangles)};
  }
};

Scene makeScene() {
  Scene s;
  const std::uint32_t n = 60;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t j = 0; j <= n; ++j) {
      const float x = 0.4f * (static_cast<float>(i) / n - 0.5f),
                  y = 0.4f * (static_cast<float>(j) / n - 0.5f);
      s.sheet.insert(s.sheet.end(), {x, y, 0.12f + 0.01f * std::sin(60 * x) * std::cos(50 * y)});
      if (i == n || j == n) continue;
      const std::uint32_t a = i * (n + 1) + j;
      s.sheet_triangles.insert(s.sheet_triangles.end(), {a, a + n + 1, a + n + 2, a, a + n + 2, a + 1});
    }
  for (std::uint32_t i = 0; i <= 20; ++i)
    for (std::uint32_t j = 0; j <= 30; ++j) {
      const float a = 3.14159265f * i / 20, b = 6.2831853f * j / 30;
      s.ball.insert(s.ball.end(), {0.01f + 0.02f * std::sin(a) * std::cos(b),
                                   0.02f * std::sin(a) * std::sin(b), 0.07f + 0.02f * std::cos(a)});
      if (i == 20 || j == 30) continue;
      const std::uint32_t k = i * 31 + j;
      s.ball_triangles.insert(s.ball_triangles.end(), {k, k + 31, k + 32, k, k + 32, k + 1});
    }
  return s;
}

camera::Intrinsics makeCamera() {
  return camera::fromFieldOfView(360, 288, 70 * 3.14159265 / 180, {-0.18, 0.03, 0, 0, 0});
}
const picture::Circle kCircle{179.5, 143.5, 144};

Eigen::Isometry3d somewhere() {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Vector3d(0.004, -0.003, 0.002);
  X.rotate(Eigen::AngleAxisd(0.15, Vector3d(0.3, 1, 0.2).normalized()));
  return X;
}

/// The nearest cut of a ray with any triangle, one after the other.
double cast(const Scene& s, const Vector3d& eye, const Vector3d& ray, std::uint16_t* label, double* edge) {
  double best = std::numeric_limits<double>::infinity();
  for (const Body& body : s.bodies())
    for (std::size_t t = 0; t < body.triangle_count; ++t) {
      Vector3d p[3];
      for (int k = 0; k < 3; ++k) {
        const float* q = body.positions + 3 * body.triangles[3 * t + static_cast<std::size_t>(k)];
        p[k] = Vector3d(q[0], q[1], q[2]);
      }
      Eigen::Matrix3d M;
      M << p[1] - p[0], p[2] - p[0], -ray;
      if (std::fabs(M.determinant()) < 1e-16) continue;
      const Vector3d w = M.inverse() * (eye - p[0]);
      const double inside = std::min({w.x(), w.y(), 1 - w.x() - w.y()});
      if (inside < 0 || w.z() < 0.002 || w.z() > best) continue;
      best = w.z();
      *label = body.label;
      *edge = inside;
    }
  return best;
}

TEST(Raster, DepthAndLabelAreThoseOfARayCastThroughThePixel) {
  const Scene s = makeScene();
  const camera::Intrinsics camera = makeCamera();
  Raster raster(camera, kCircle);
  const Eigen::Isometry3d X_WO = somewhere();
  raster.draw(s.bodies(), X_WO);
  cv::Mat depth, labels;
  raster.depth(&depth);
  raster.segmentation(&labels);
  std::mt19937 random(5);
  int ball = 0, sheet = 0, wrong_label = 0;
  for (int i = 0; i < 400; ++i) {
    const int u = static_cast<int>(random() % 360), v = static_cast<int>(random() % 288);
    if (std::hypot(u - kCircle.cx, v - kCircle.cy) > kCircle.radius) {
      EXPECT_TRUE(std::isnan(depth.at<float>(v, u)));
      EXPECT_EQ(labels.at<std::uint16_t>(v, u), kBackground);
      continue;
    }
    const Eigen::Vector2d n = camera::unproject(camera, {double(u), double(v)});
    std::uint16_t label = 0;
    double edge = 0;
    const double expected =
        cast(s, X_WO.translation(), X_WO.linear() * Vector3d(n.x(), n.y(), 1), &label, &edge);
    ASSERT_TRUE(std::isfinite(expected));
    if (labels.at<std::uint16_t>(v, u) != label) {
      ++wrong_label;
      continue;
    }
    (label == 3 ? ball : sheet) += 1;
    EXPECT_NEAR(depth.at<float>(v, u), expected, 0.0005 * expected) << u << " " << v;
  }
  EXPECT_GT(ball, 40);
  EXPECT_GT(sheet, 100);
  EXPECT_LE(wrong_label, 2) << "only pixels on the silhouette may differ";
}

TEST(Raster, FlowIsThePixelNowMinusThePixelBefore) {
  Scene s = makeScene();
  s.sheet_before = s.sheet;
  s.ball_before = s.ball;
  for (std::size_t i = 0; i < s.ball.size(); i += 3) s.ball[i] += 0.002f, s.ball[i + 2] -= 0.001f;
  const camera::Intrinsics camera = makeCamera();
  Raster raster(camera, kCircle);
  const Eigen::Isometry3d before = somewhere();
  Eigen::Isometry3d now = before;
  now.translate(Vector3d(0.001, 0.0005, 0.002));
  now.rotate(Eigen::AngleAxisd(0.02, Vector3d::UnitY()));
  raster.draw(s.bodies(), now);
  cv::Mat flow, depth, labels;
  raster.flow(before, &flow);
  raster.depth(&depth);
  raster.segmentation(&labels);
  int moved = 0;
  for (int v = 10; v < 288; v += 13)
    for (int u = 10; u < 360; u += 13) {
      const float z = depth.at<float>(v, u);
      if (!std::isfinite(z)) continue;
      const Eigen::Vector2d n = camera::unproject(camera, {double(u), double(v)});
      Vector3d p = now * Vector3d(n.x() * z, n.y() * z, z);
      if (labels.at<std::uint16_t>(v, u) == 3) p -= Vector3d(0.002, 0, -0.001), ++moved;
      const Vector3d q = before.inverse() * p;
      const Eigen::Vector2d was = camera::project(camera, {q.x() / q.z(), q.y() / q.z()});
      EXPECT_NEAR(flow.at<cv::Vec2f>(v, u)[0], u - was.x(), 0.02);
      EXPECT_NEAR(flow.at<cv::Vec2f>(v, u)[1], v - was.y(), 0.02);
    }
  EXPECT_GT(moved, 20);
}

TEST(Raster, NothingAndGarbageGiveEmptyPictures) {
  Raster raster(makeCamera(), kCircle);
  raster.draw({}, Eigen::Isometry3d::Identity());
  cv::Mat depth;
  raster.depth(&depth);
  EXPECT_TRUE(std::isnan(depth.at<float>(143, 179)));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float positions[] = {nan, 0, 0.1f, 0.1f, nan, 0.1f, 0, 0, -0.1f, 0, 0, 0};
  const std::uint32_t triangles[] = {0, 1, 2, 2, 2, 2, 1, 3, 3};
  raster.draw({Body{9, positions, nullptr, 4, triangles, 3}}, Eigen::Isometry3d::Identity());
  cv::Mat labels;
  raster.segmentation(&labels);
  EXPECT_EQ(cv::countNonZero(labels), 0);
}

TEST(Raster, TrianglesThatReachBehindTheCameraAreCutOff) {
  const float positions[] = {-1, 0.02f, -1, 1, 0.02f, -1, 0, 0.02f, 3};  // a floor 2 cm below the axis
  const std::uint32_t triangles[] = {0, 1, 2};
  const camera::Intrinsics camera = makeCamera();
  Raster raster(camera, kCircle);
  raster.draw({Body{9, positions, nullptr, 3, triangles, 1}}, Eigen::Isometry3d::Identity());
  for (int v : {160, 200, 260}) {
    const Eigen::Vector2d n = camera::unproject(camera, {180, double(v)});
    EXPECT_NEAR(raster.depthAt(180, v), 0.02 / n.y(), 1e-4 * 0.02 / n.y()) << v;
  }
  EXPECT_TRUE(std::isnan(raster.depthAt(180, 100)));
}

TEST(Keypoints, LieWhereTheFramesProjectAndKnowWhatHidesThem) {
  const camera::Intrinsics camera = makeCamera();
  Raster raster(camera, kCircle);
  Scene s = makeScene();
  raster.draw(s.bodies(), Eigen::Isometry3d::Identity());
  InstrumentPose i;
  i.name = "left";
  i.label = kFirstInstrument;
  i.jaw = 0.6;
  i.jaw_length = 0.02;
  i.pivot = Vector3d(-0.12, 0, 0.02);
  i.X_WTip = Eigen::Isometry3d::Identity();
  i.X_WTip.translation() = Vector3d(-0.025, 0, 0.06);
  // z of the tip along the shaft, x across it.
  const Vector3d z = (i.X_WTip.translation() - i.pivot).normalized(), x = Vector3d::UnitY();
  i.X_WTip.linear() << x, z.cross(x), z;
  std::vector<Keypoint> k;
  appendKeypoints(i, camera, kCircle, Eigen::Isometry3d::Identity(), raster, &k);
  ASSERT_EQ(k.size(), 5u);
  const Eigen::Vector2d tip = camera::project(camera, {-0.025 / 0.06, 0});
  EXPECT_EQ(k[0].name, "tip");
  EXPECT_NEAR(k[0].u, tip.x(), 1e-9);
  EXPECT_NEAR(k[0].v, tip.y(), 1e-9);
  EXPECT_NEAR(k[0].depth, 0.06, 1e-12);
  EXPECT_EQ(k[0].visibility, 2);
  EXPECT_EQ(k[1].name, "jaw_left");
  EXPECT_GT(k[1].v, k[2].v) << "left opens towards +x of the tip, which is down in this picture";
  EXPECT_EQ(k[4].name, "entry");
  EXPECT_NEAR(std::hypot(k[4].u - kCircle.cx, k[4].v - kCircle.cy), kCircle.radius, 0.6);
  // Behind the ball.
  i.X_WTip.translation() = Vector3d(0.01, 0, 0.10);
  k.clear();
  appendKeypoints(i, camera, kCircle, Eigen::Isometry3d::Identity(), raster, &k);
  EXPECT_EQ(k[0].visibility, 1);
  // Behind the camera.
  i.X_WTip.translation().z() = -0.05;
  k.clear();
  appendKeypoints(i, camera, kCircle, Eigen::Isometry3d::Identity(), raster, &k);
  EXPECT_EQ(k[0].visibility, 0);
  EXPECT_TRUE(std::isnan(k[0].u));
}

}  // namespace
}  // namespace vest::truth

// Protects the picture of a volume: Beer-Lambert at any step, the same as a plain sum along each ray, ends at
// surfaces and cuts, nothing where nothing was measured, the same bytes for any number of threads.
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "vest_tissue/image/brick.h"
#include "vest_tissue/image/phantom.h"
#include "vest_viz/volume/ray_caster.h"

namespace {

using namespace vest::volume;
using Eigen::Vector3d;

/// A block of equal values, 10 mm along each edge, middle at the origin.
Brick block(std::int16_t number) {
  Brick b;
  b.size = {20, 10, 4};
  b.axes = Vector3d(0.5e-3, 1e-3, 2.5e-3).asDiagonal();
  b.origin = b.axes * Vector3d(-9.5, -4.5, -1.5);
  b.stored.assign(b.voxels(), number);
  return b;
}

const TransferTable kTable{{0, {1, 0.5, 0}, 0.2, {}}, {100, {1, 0.5, 0}, 0.2, {}}};

/// Looks along -z of `turn` at the origin, without perspective, 2 × half wide.
Eigen::Matrix4d alongZ(double half, const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity()) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = turn * Vector3d(half, half, -0.1).asDiagonal();
  return m;
}

Eigen::Matrix4d perspective(const Vector3d& eye, const Eigen::Matrix3d& turn) {
  const double near = 0.01, far = 10, wide = 0.35;
  Eigen::Matrix4d p = Eigen::Matrix4d::Zero();
  p(0, 0) = p(1, 1) = 1 / wide;
  p(2, 2) = -(far + near) / (far - near), p(2, 3) = -2 * far * near / (far - near), p(3, 2) = -1;
  Eigen::Isometry3d camera = Eigen::Isometry3d::Identity();
  camera.linear() = turn;
  camera.translation() = eye;
  return camera.matrix() * p.inverse();
}

class OneRay : public testing::Test {
 protected:
  std::array<int, 4> look(const Brick& brick, const Look& how, float depth = 1,
                          const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity(),
                          const TransferTable& table = kTable) {
    RayCaster caster(std::make_shared<Brick>(brick));
    caster.setTable(table);
    View view{1, 1, alongZ(0.001, turn), &depth};
    std::vector<std::uint8_t> rgba;
    EXPECT_TRUE(caster.cast(view, how, pool, &rgba));
    return {rgba[0], rgba[1], rgba[2], rgba[3]};
  }
  vest::solver::Pool pool;
};

double opaque(double millimetres) {
  return 255 * (1 - std::pow(1 - 0.2, millimetres));
}

TEST_F(OneRay, ABlockObeysBeerAndLambertAtAnyStep) {
  for (const double step : {0.05, 0.3, 0.37, 1.0, 2.3, 7.0, 20.0}) {
    SCOPED_TRACE(step);
    const auto c = look(block(50), {1e-3 * step, true, {}});
    EXPECT_NEAR(c[3], opaque(10), 1);
    EXPECT_NEAR(c[0], opaque(10), 1);
    EXPECT_NEAR(c[1], 0.5 * opaque(10), 1);
    EXPECT_EQ(c[2], 0);
    const Eigen::Matrix3d slanted = Eigen::AngleAxisd(M_PI / 6, Vector3d::UnitX()).toRotationMatrix();
    EXPECT_NEAR(look(block(50), {1e-3 * step, true, {}}, 1, slanted)[3], opaque(10 / std::cos(M_PI / 6)), 1);
  }
}

TEST_F(OneRay, EndsAtASurfaceAndAtCuts) {
  // z of the device is 0 at the origin: half of the block lies before it.
  for (const double step : {0.3, 2.3}) {
    EXPECT_NEAR(look(block(50), {1e-3 * step, true, {}}, 0.0f)[3], opaque(5), 1);
    EXPECT_EQ(look(block(50), {1e-3 * step, true, {}}, -0.5f)[3], 0) << "the surface is before the block";
    EXPECT_EQ(look(block(50), {1e-3 * step, true, {}}, 0.9f)[3], look(block(50), {1e-3 * step, true, {}})[3]);
    const vest::inspect::Plane above{{0, 0, 1}, 0.002f}, below{{0, 0, -1}, 0.001f};
    EXPECT_NEAR(look(block(50), {1e-3 * step, true, {above}})[3], opaque(7), 1);
    EXPECT_NEAR(look(block(50), {1e-3 * step, true, {above, below}})[3], opaque(3), 1);
  }
}

TEST_F(OneRay, NothingIsSeenWhereNothingWasMeasured) {
  EXPECT_EQ(look(block(Brick::kNothing), {})[3], 0);
  Brick half = block(50);
  for (std::size_t v = 0; v < half.voxels() / 2; ++v) half.stored[v] = Brick::kNothing;
  EXPECT_NEAR(look(half, {1e-4, true, {}})[3], opaque(5), 1);
}

TEST_F(OneRay, AnOpaqueRowHidesAllBehindIt) {
  const TransferTable bone{{0, {1, 1, 1}, 1, {}}, {100, {1, 1, 1}, 1, {}}};
  EXPECT_EQ(look(block(50), {1e-3, true, {}}, 1, Eigen::Matrix3d::Identity(), bone),
            (std::array<int, 4>{255, 255, 255, 255}));
}

class Head : public testing::Test {
 protected:
  static std::shared_ptr<const Brick> brick() {
    vest::image::PhantomImage options;
    options.size = {70, 61, 33};
    options.noise = 10;
    const auto volume = vest::image::picture(vest::image::makePhantom("head"), options);
    return std::make_shared<Brick>(vest::image::toBrick(volume, Vector3d::Zero()));
  }
  static Eigen::Matrix4d camera() {
    const Eigen::Matrix3d turn =
        (Eigen::AngleAxisd(0.4, Vector3d::UnitZ()) * Eigen::AngleAxisd(1.1, Vector3d::UnitX()))
            .toRotationMatrix();
    return perspective(turn * Vector3d(0, 0, 0.5) + Vector3d(0, 0, 0.1), turn);
  }
};

const TransferTable kSoft{
    {-200, {1, 0, 0}, 0, {}}, {60, {0.8, 0.3, 0.2}, 0.05, {}}, {900, {1, 1, 1}, 0.6, {}}};

TEST_F(Head, HasTheSameBytesForAnyNumberOfThreads) {
  RayCaster caster(brick());
  caster.setTable(kSoft);
  const View view{90, 72, camera()};
  std::vector<std::uint8_t> one, other;
  vest::solver::Pool alone;
  ASSERT_TRUE(caster.cast(view, {}, alone, &one));
  EXPECT_GT(std::count_if(one.begin(), one.end(), [](std::uint8_t v) { return v > 100; }), 2000);
  for (const int threads : {2, 3, 7}) {
    vest::solver::Pool pool(threads);
    ASSERT_TRUE(caster.cast(view, {}, pool, &other));
    EXPECT_EQ(one, other) << threads;
  }
}

/// The sum along a ray by the book, without blocks, tables of entries and an early end.
std::array<double, 4> byTheBook(const Brick& b, const TransferTable& table, const Eigen::Matrix4d& from_clip,
                                double x, double y, double step) {
  const auto place = [&](double z) -> Vector3d {
    return (from_clip * Eigen::Vector4d(x, y, z, 1)).hnormalized();
  };
  const Vector3d eye = place(-1), along = (place(0.9) - eye).normalized();
  const Eigen::Matrix3d inverse = b.axes.inverse();
  std::array<double, 4> sum{};
  for (double t = 0.5 * step; t < 1; t += step) {
    const Vector3d at = inverse * (eye + t * along - b.origin);
    bool inside = true;
    for (int a = 0; a < 3; ++a) inside = inside && at[a] >= -0.5 && at[a] <= b.size[a] - 0.5;
    float number = 0;
    if (!inside || !interpolate(b, at.cast<float>(), number)) continue;
    const Transfer row = transfer(table, b.intercept + b.slope * number);
    const double share = (1 - sum[3]) * (1 - std::pow(1 - row.alpha, 1e3 * step));
    for (int c = 0; c < 3; ++c) sum[c] += share * row.colour[c];
    sum[3] += share;
  }
  return sum;
}

TEST_F(Head, IsTheSumAlongEachRayByTheBook) {
  const auto head = brick();
  RayCaster caster(head);
  vest::solver::Pool pool;
  for (const TransferTable& table :
       {kSoft, TransferTable{{250, {1, 1, 1}, 0, {}}, {400, {1, 0.9, 0.8}, 0.3, {}}}}) {
    caster.setTable(table);
    const View view{24, 20, camera()};
    std::vector<std::uint8_t> rgba;
    ASSERT_TRUE(caster.cast(view, {1e-4, false, {}}, pool, &rgba));
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        const auto sum = byTheBook(*head, table, view.from_clip, 2 * (x + 0.5) / view.width - 1,
                                   1 - 2 * (y + 0.5) / view.height, 1e-4);
        for (int c = 0; c < 4; ++c)
          ASSERT_NEAR(rgba[4 * (y * view.width + x) + c], 255 * sum[c], 3) << x << " " << y;
      }
  }
}

TEST_F(Head, StopsWhenItIsTold) {
  RayCaster caster(brick());
  caster.setTable(kSoft);
  vest::solver::Pool pool(2);
  const std::atomic<bool> stop{true};
  std::vector<std::uint8_t> rgba;
  EXPECT_FALSE(caster.cast({90, 72, camera()}, {}, pool, &rgba, &stop));
}

}  // namespace

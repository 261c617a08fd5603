#include "vest_viz/effects/drops.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

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

/// Extent of a quad along an axis, m.
float extent(const Quads& q, std::size_t quad, int axis) {
  float low = 1, high = -1;
  for (std::size_t k = 0; k < 4; ++k) {
    low = std::min(low, q.corners[12 * quad + 3 * k + static_cast<std::size_t>(axis)]);
    high = std::max(high, q.corners[12 * quad + 3 * k + static_cast<std::size_t>(axis)]);
  }
  return high - low;
}

TEST(Drops, HaveTheVolumeOfTheirParticlesAndAreDrawnOutAlongTheirMotion) {
  const float p[] = {0, 0, 0.1f, 0.01f, 0, 0.1f, kNaN, 0, 0, -0.01f, 0, 0.1f};
  const float v[] = {0, 0.3f, 0, 0, 2.0f, 0, 0, 0, 0, 0, 0.3f, 0};
  const std::uint8_t volume[] = {255, 32, 255, 32};
  FluidParticles in;
  in.positions = p, in.velocities = v, in.volume = volume, in.count = 4, in.radius = 0.0005;
  Quads q;
  EXPECT_EQ(addDrops(in, Vector3d::Zero(), 0.01, &q), 1u) << "the NaN is left out";
  ASSERT_EQ(q.count(), 3u);
  // A ball of 1 mm³ is 1.24 mm wide, one of an eighth half of that.
  EXPECT_NEAR(extent(q, 0, 0), 0.00124, 1e-5);
  EXPECT_NEAR(extent(q, 2, 0), 0.00062, 1e-5);
  EXPECT_NEAR(extent(q, 0, 1), 0.00124 + 0.003, 1e-5) << "0.3 m/s for 10 ms";
  EXPECT_NEAR(extent(q, 1, 1), 0.00062 + 0.02, 1e-5);
  EXPECT_NEAR(q.colours[1], 0.003 / 0.00062, 0.05) << "how long it is, for the shader to fade it";
}

TEST(Drops, ThatFollowOneAnotherAreAStreamOfTheirVolume) {
  // Four particles of 27 mm³, 9 mm apart, fly upwards one behind the other.
  std::vector<float> p, v;
  for (int i = 0; i < 4; ++i) {
    p.insert(p.end(), {0, 0.009f * static_cast<float>(i), 0.1f});
    v.insert(v.end(), {0, 0.3f, 0});
  }
  FluidParticles in;
  in.positions = p.data(), in.velocities = v.data(), in.count = 4, in.radius = 0.0015;
  Quads q;
  addDrops(in, Vector3d::Zero(), 0.008, &q);
  ASSERT_EQ(q.count(), 4u) << "three cylinders, and the drop at the head";
  EXPECT_NEAR(extent(q, 0, 1), 0.009, 1e-4);
  EXPECT_NEAR(extent(q, 0, 0), 2 * std::sqrt(27e-9 / (3.14159265 * 0.009)), 1e-5);
  EXPECT_FLOAT_EQ(q.features[1], 2.0f) << "drawn as a stream";
  // Beside others they are a body of fluid: each is drawn by itself.
  for (int i = 0; i < 4; ++i)
    for (const float x : {-0.003f, 0.0f, 0.003f})
      for (const float z : {0.097f, 0.1f, 0.103f}) {
        if (x == 0 && z == 0.1f) continue;
        p.insert(p.end(), {x, 0.009f * static_cast<float>(i), z});
        v.insert(v.end(), {0, 0.3f, 0});
      }
  in.positions = p.data(), in.velocities = v.data(), in.count = p.size() / 3;
  q.clear();
  addDrops(in, Vector3d::Zero(), 0.008, &q);
  int streams = 0;
  for (std::size_t k = 0; k < q.count(); ++k) streams += q.features[12 * k + 1] > 1.5f;
  EXPECT_EQ(streams, 0);
}

TEST(Drops, OfAFastJetAreAStreamThoughTheyFlyFarApart) {
  // A spurt at 1.5 m/s whose particles are 3 cm apart; slow ones as far apart are drops.
  const float p[] = {0, 0, 0.1f, 0, 0.03f, 0.1f}, fast[] = {0, 1.5f, 0, 0, 1.45f, 0.05f},
              slow[] = {0, 0.3f, 0, 0, 0.3f, 0};
  FluidParticles in;
  in.positions = p, in.velocities = fast, in.count = 2, in.radius = 0.0015;
  Quads q;
  addDrops(in, Vector3d::Zero(), 0.008, &q);
  ASSERT_EQ(q.count(), 2u) << "a cylinder, and the drop at the head";
  EXPECT_NEAR(extent(q, 0, 1), 0.03, 1e-4);
  q.clear();
  in.velocities = slow;
  addDrops(in, Vector3d::Zero(), 0.008, &q);
  for (std::size_t k = 0; k < q.count(); ++k) EXPECT_LT(q.features[12 * k + 1], 1.5f);
}

TEST(Drops, FastOnesShedSatellitesOfTheSameVolumeTogether) {
  const float p[] = {0, 0, 0.1f}, v[] = {1.0f, 0.5f, 0};
  FluidParticles in;
  in.positions = p, in.velocities = v, in.count = 1, in.radius = 0.001;
  Quads q, again;
  addDrops(in, Vector3d::Zero(), 0.008, &q);
  ASSERT_EQ(q.count(), 3u);
  double volume = 0;  // of balls, mm³
  for (std::size_t k = 0; k < 3; ++k) volume += 4.18879 * std::pow(q.colours[12 * k], 3);
  EXPECT_NEAR(volume, 8, 1e-3);
  addDrops(in, Vector3d::Zero(), 0.008, &again);
  EXPECT_EQ(q.corners, again.corners) << "they stay with their drop";
}

TEST(Pool, IsWetWhereItsCellsAreAndShallowsTowardsItsBorder) {
  const float n = kNaN;
  const float h[] = {n, n, n, n, n, n, 1, 1, 1, n, n, 1, 1, 1, n, n, 1, 1, 1, n, n, n, n, n, n};
  const std::vector<std::uint8_t> depth(25, 80), blood(25, 51);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Vector3d(1, 0, 0);
  PoolCells cells;
  cells.height = h, cells.depth = depth.data(), cells.blood = blood.data();
  const Pool pool = poolSurface(X, 0.01, 5, 5, cells);
  ASSERT_EQ(pool.positions.size() / 3, 117u) << "nine wet cells, the sixteen round them, and half-way";
  for (std::size_t i = 0; i < pool.features.size(); i += 3) {
    EXPECT_NEAR(pool.features[i], 0.2f, 1e-6);
    EXPECT_FLOAT_EQ(pool.positions[i + 2], 1) << "the border lies level with its neighbours";
    const double out =
        std::max(std::fabs(pool.positions[i] - 1.025), std::fabs(pool.positions[i + 1] - 0.025));
    if (out < 1e-6) {
      EXPECT_NEAR(pool.features[i + 1], 8, 1e-5) << "mm";
    }
    if (out < 0.0101) {
      EXPECT_GT(pool.features[i + 1], 0);
    }
    if (out > 0.0199) {
      EXPECT_LT(pool.features[i + 1], 1.0f);
    }
  }
  EXPECT_TRUE(poolSurface(X, 0.0, 5, 5, cells).triangles.empty());
  cells.depth = cells.blood = nullptr, cells.blood_fraction = 0.5;
  const Pool unknown = poolSurface(X, 0.01, 5, 5, cells);
  EXPECT_FLOAT_EQ(unknown.features[0], 0.5f);
  EXPECT_FLOAT_EQ(*std::max_element(unknown.features.begin(), unknown.features.end()), kUnknownDepth) << "mm";
}

TEST(Pool, ItsShoreRunsWhereTheGroundRisesAboveItsLevelNotAlongItsCells) {
  // Ground that rises by 1 in 4 to the upper right: the shore is straight, its cells are stairs.
  constexpr int kCells = 40;
  constexpr double kCell = 0.004, kRise = 0.25, kShore = 0.055;  // m, along the diagonal
  std::vector<float> height(kCells * kCells);
  std::vector<std::uint8_t> depth(height.size());
  for (int r = 0; r < kCells; ++r)
    for (int c = 0; c < kCells; ++c) {
      const double under = kRise * (kShore - (c + 1.3 * r + 1.15) * kCell / std::hypot(1, 1.3));
      const auto i = static_cast<std::size_t>(r * kCells + c);
      height[i] = under > 1e-4 ? 0 : kNaN;
      depth[i] = static_cast<std::uint8_t>(std::lround(std::clamp(1e4 * under, 0.0, 255.0)));
    }
  PoolCells cells;
  cells.height = height.data(), cells.depth = depth.data();
  const Pool pool = poolSurface(Eigen::Isometry3d::Identity(), kCell, kCells, kCells, cells);
  double furthest = 0;
  int crossings = 0;
  for (std::size_t k = 0; k < pool.triangles.size(); ++k) {
    const std::size_t a = pool.triangles[k], b = pool.triangles[k % 3 == 2 ? k - 2 : k + 1];
    const double u = pool.features[3 * a + 1], v = pool.features[3 * b + 1];
    if ((u > 0) == (v > 0)) continue;
    const double s = u / (u - v);
    const double x = pool.positions[3 * a] + s * (pool.positions[3 * b] - pool.positions[3 * a]),
                 y = pool.positions[3 * a + 1] + s * (pool.positions[3 * b + 1] - pool.positions[3 * a + 1]);
    if (x < kCell || y < kCell) continue;  // it ends there with its cells
    furthest = std::max(furthest, std::fabs((x + 1.3 * y) / std::hypot(1, 1.3) - kShore));
    ++crossings;
  }
  EXPECT_GT(crossings, 40);
  EXPECT_LT(furthest, 0.3 * kCell) << "m";
}

/// Least and greatest distance of the shore from a place, m.
std::pair<double, double> shoreOf(const Pool& pool, double px, double py) {
  double least = 1, most = 0;
  for (std::size_t k = 0; k < pool.triangles.size(); ++k) {
    const std::size_t a = pool.triangles[k], b = pool.triangles[k % 3 == 2 ? k - 2 : k + 1];
    const double u = pool.features[3 * a + 1], v = pool.features[3 * b + 1];
    if ((u > 0) == (v > 0)) continue;
    const double s = u / (u - v);
    const double x = pool.positions[3 * a] + s * (pool.positions[3 * b] - pool.positions[3 * a]),
                 y = pool.positions[3 * a + 1] + s * (pool.positions[3 * b + 1] - pool.positions[3 * a + 1]);
    const double d = std::hypot(x - px, y - py);
    least = std::min(least, d), most = std::max(most, d);
  }
  return {least, most};
}

TEST(Pool, APuddleOfAFewCellsIsRoundNotABox) {
  constexpr std::size_t kCells = 5;
  std::vector<float> height(kCells * kCells, kNaN);
  std::vector<std::uint8_t> depth(height.size(), 0);
  for (std::size_t r = 1; r < 4; ++r)
    for (std::size_t c = 1; c < 4; ++c) height[r * kCells + c] = 0, depth[r * kCells + c] = 15;
  PoolCells cells;
  cells.height = height.data(), cells.depth = depth.data();
  const auto shore =
      shoreOf(poolSurface(Eigen::Isometry3d::Identity(), 0.004, kCells, kCells, cells), 0.010, 0.010);
  EXPECT_GT(shore.first, 0.006) << "m";
  EXPECT_LT(shore.second, 1.09 * shore.first) << "its corners were 1.13 times as far as its sides";
}

TEST(Pool, ItsVerticesKnowHowTheWavesRun) {
  const float height[4] = {0, 0, 0, 0}, velocity[4] = {-0.02f, -0.02f, -0.02f, -0.02f};
  PoolCells cells;
  cells.height = height, cells.velocity = velocity;
  const Pool pool = poolSurface(Eigen::Isometry3d::Identity(), 0.004, 2, 2, cells);
  float most = 0;
  for (std::size_t i = 2; i < pool.features.size(); i += 3) most = std::max(most, pool.features[i]);
  EXPECT_GT(most, 0.01f) << "m/s, either way";
  EXPECT_LE(most, 0.02f);
}

TEST(Film, LiesOnItsGroundThinsOutAndLeavesNothingWhereThereIsNone) {
  std::vector<float> height(25, kNaN);
  std::vector<std::uint8_t> thickness(25, 0), set(25, 0);
  for (const std::size_t i : {11, 12, 13}) height[i] = 0.001f, thickness[i] = 50, set[i] = 255;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Vector3d(0, 0, 1);
  const Pool film = filmSurface(X, 0.004, 5, 5, height.data(), thickness.data(), set.data());
  ASSERT_FALSE(film.triangles.empty());
  float most = 0;
  for (const std::uint32_t v : film.triangles) {
    EXPECT_NEAR(film.positions[3 * v + 2], 1.001, 1e-6) << "m";
    EXPECT_NEAR(film.positions[3 * v + 1], 0.010, 0.0101) << "no farther than the border and its noise";
    most = std::max(most, film.features[3 * v]);
    EXPECT_NEAR(film.features[3 * v + 1], 1, 1e-6) << "set";
  }
  EXPECT_GT(most, 25) << "µm";
  EXPECT_LE(most, 50);
  std::fill(thickness.begin(), thickness.end(), 0);
  EXPECT_TRUE(filmSurface(X, 0.004, 5, 5, height.data(), thickness.data(), set.data()).triangles.empty());
  EXPECT_TRUE(filmSurface(X, 0, 5, 5, height.data(), thickness.data(), set.data()).triangles.empty());
}

// Protects a stain's border from straight cuts: how steeply it thins out is told at each vertex, and not by
// triangles.
TEST(Film, TellsAtEachVertexHowSteeplyItRises) {
  const std::vector<float> height(64, 0.0f);
  std::vector<std::uint8_t> thickness(64, 0), set(64, 0);
  for (int r = 2; r < 6; ++r)
    for (int c = 2; c < 6; ++c) thickness[static_cast<std::size_t>(8 * r + c)] = 100;
  const Pool film =
      filmSurface(Eigen::Isometry3d::Identity(), 0.004, 8, 8, height.data(), thickness.data(), set.data());
  std::map<std::pair<long, long>, std::size_t> at;  // by half cells
  const auto half = [&](std::size_t v, std::size_t axis) {
    return std::lround(film.positions[3 * v + axis] / 0.002);
  };
  for (std::size_t v = 0; v < film.features.size() / 3; ++v) at[{half(v, 0), half(v, 1)}] = v;
  int inner = 0;
  float most = 0;
  for (const auto& [place, v] : at) {
    const auto depth = [&](long x, long y) {
      const auto found = at.find({place.first + x, place.second + y});
      return found == at.end() ? std::nanf("") : film.features[3 * found->second];
    };
    const float x = (depth(1, 0) - depth(-1, 0)) / 0.004f, y = (depth(0, 1) - depth(0, -1)) / 0.004f;
    if (std::isnan(x) || std::isnan(y)) continue;
    EXPECT_NEAR(film.features[3 * v + 2], std::hypot(x, y), 1.0f) << "µm/m";
    most = std::max(most, film.features[3 * v + 2]), ++inner;
  }
  EXPECT_GT(inner, 100);
  EXPECT_GT(most, 5000) << "µm/m: 100 µm over some cells of 4 mm";
}

TEST(Film, GoesOnUnderWhatIsNarrowerThanACellAndHasRoomForWhatIsDry) {
  // Two stains with a gap of one cell, as a vessel on the ground leaves it, and of four.
  const auto between = [](int gap) {
    constexpr std::uint32_t kColumns = 12, kRows = 5;
    std::vector<float> height(kColumns * kRows, 0.0f);
    std::vector<std::uint8_t> thickness(height.size(), 100), set(height.size(), 0);
    for (std::uint32_t r = 0; r < kRows; ++r)
      for (std::uint32_t c = 4; c < 4 + static_cast<std::uint32_t>(gap); ++c)
        height[r * kColumns + c] = kNaN, thickness[r * kColumns + c] = 0;
    const Pool film = filmSurface(Eigen::Isometry3d::Identity(), 0.004, kColumns, kRows, height.data(),
                                  thickness.data(), set.data());
    float least = 255;
    for (std::size_t v = 0; v < film.features.size() / 3; ++v) {
      const float x = film.positions[3 * v], y = film.positions[3 * v + 1];
      if (x > 0.015f && x < 0.017f + 0.004f * static_cast<float>(gap) && y > 0.006f && y < 0.014f)
        least = std::min(least, film.features[3 * v]);
    }
    return least;
  };
  EXPECT_GT(between(1), 90) << "µm";
  EXPECT_EQ(between(4), 0);
}

/// A surgeon sees a stain with straight sides at once. Its outline wanders by more than a millimetre beside
/// the cells' side, and stays where it is when the rectangle of cells grows.
/// m, by y in tenths of a millimetre: where a row of the mesh has no more than `level` of a feature, from
/// x = 12 mm to the right.
std::map<long, double> outlineOf(const Pool& mesh, std::size_t feature, float level) {
  std::map<long, double> found;
  std::map<long, std::map<double, float>> rows;
  for (std::size_t v = 0; v < mesh.features.size() / 3; ++v)
    rows[std::lround(1e4 * mesh.positions[3 * v + 1])][mesh.positions[3 * v]] =
        mesh.features[3 * v + feature];
  for (const auto& [y, row] : rows)
    for (auto a = row.lower_bound(0.012), b = std::next(a); y >= 100 && y <= 380 && b != row.end(); ++a, ++b)
      if (a->second >= level && b->second < level && found.count(y) == 0)
        found[y] = a->first + (b->first - a->first) * (a->second - level) / (a->second - b->second);
  return found;
}

/// Six columns of wet cells, with a border along x = 24 mm; `before` dry ones to their left.
constexpr double kStripCell = 0.004;
constexpr int kStripRows = 12, kStripWet = 6, kStripAfter = 2;
Eigen::Isometry3d stripAt(int before) {
  return Eigen::Isometry3d(Eigen::Translation3d(-kStripCell * before, 0, 0));
}
template <class T>
std::vector<T> strip(int before, T dry, T wet) {
  const int columns = before + kStripWet + kStripAfter;
  std::vector<T> cells(static_cast<std::size_t>(columns * kStripRows), dry);
  for (int r = 0; r < kStripRows; ++r) std::fill_n(cells.begin() + r * columns + before, kStripWet, wet);
  return cells;
}
/// @param make the strip with so many dry columns
template <class Make>
void expectFrayed(Make make, std::size_t feature, float level) {
  const auto once = outlineOf(make(0), feature, level), again = outlineOf(make(3), feature, level);
  ASSERT_GT(once.size(), 10u);
  double least = 1, most = 0;
  for (const auto& [y, x] : once) {
    least = std::min(least, x), most = std::max(most, x);
    ASSERT_EQ(again.count(y), 1u);
    EXPECT_NEAR(again.at(y), x, 1e-5) << "m";
  }
  EXPECT_GT(most - least, 0.001) << "m";
  EXPECT_LT(most - least, 0.006) << "m";
}

TEST(Film, ItsOutlineDoesNotRunAlongItsCellsAndStandsStillInTheWorld) {
  const auto stain = [](int before) {
    const auto height = strip(before, 0.0f, 0.0f);
    const auto thickness = strip<std::uint8_t>(before, 0, 140), set = strip<std::uint8_t>(before, 0, 0);
    return filmSurface(stripAt(before), kStripCell,
                       static_cast<std::uint32_t>(before + kStripWet + kStripAfter), kStripRows,
                       height.data(), thickness.data(), set.data());
  };
  expectFrayed(stain, 0, 70);
}

// The noise of borders is a table that repeats: it has no seam left of its begin, and no place is beyond it.
TEST(Film, FraysAlikeOnEitherSideOfTheWorldsMiddleAndTakesAnyPlace) {
  const auto at = [](double x) {
    Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();
    origin.translation().x() = x;
    const std::vector<float> height(64, 0.0f);
    std::vector<std::uint8_t> thickness(64, 0), set(64, 0);
    for (std::size_t i = 18; i < 46; ++i) thickness[i] = 100;
    return filmSurface(origin, 0.004, 8, 8, height.data(), thickness.data(), set.data());
  };
  const std::vector<float> here = at(0.01).features;
  const double period = 16 * 0.0085;  // m
  for (const double turns : {-1.0, -3.0, 2.0}) {
    const std::vector<float> there = at(0.01 + turns * period).features;
    ASSERT_EQ(there.size(), here.size());
    for (std::size_t i = 0; i < here.size(); ++i) EXPECT_NEAR(there[i], here[i], 0.01) << turns;
  }
  EXPECT_NE(at(0.01 + 0.5 * period).features, here);
  for (const float value : at(-1e30).features) EXPECT_TRUE(std::isfinite(value));
}

TEST(Pool, AtASteepWallItsShoreDoesNotRunAlongItsCellsEither) {
  const auto pool = [](int before) {
    const auto height = strip(before, kNaN, 0.0f);
    const auto depth = strip<std::uint8_t>(before, 0, 100);  // 1 cm
    PoolCells cells;
    cells.height = height.data(), cells.depth = depth.data();
    return poolSurface(stripAt(before), kStripCell,
                       static_cast<std::uint32_t>(before + kStripWet + kStripAfter), kStripRows, cells);
  };
  expectFrayed(pool, 1, 0);
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

TEST(Veil, SmokeOfOneCellHasNoStraightEdge) {
  const camera::Intrinsics source = camera::fromFieldOfView(1280, 640, 1.2, {0, 0, 0, 0, 0});
  smoke::Field field;
  field.origin = Vector3d(-0.055, -0.055, 0.06);
  field.cell = 0.01;
  field.size[0] = field.size[1] = 11, field.size[2] = 4;
  field.scale = 0.02f;
  field.density.assign(484, 0);
  for (std::size_t i = 5; i < 484; i += 11) field.density[i] = 255;  // a wall of smoke one cell thick
  const cv::Mat rendering(640, 1280, CV_8UC4, cv::Scalar(100, 50, 50, 0));
  smoke::Veil veil;
  cv::Mat out;
  veil.draw(field, source, Eigen::Isometry3d::Identity(), rendering, 0, 0.0035, &out);
  ASSERT_EQ(out.cols, 160);
  std::vector<double> mean(160, 0);
  for (int row = 20; row < 60; ++row)
    for (int column = 0; column < 160; ++column) mean[column] += out.at<cv::Vec4b>(row, column)[3] / 40.0;
  double steepest = 0;
  for (int column = 1; column < 160; ++column)
    steepest = std::max(steepest, std::fabs(mean[column] - mean[column - 1]));
  const double most = *std::max_element(mean.begin(), mean.end());
  EXPECT_GT(most, 20);
  EXPECT_LT(steepest, 0.15 * most) << "a cell is twelve of these columns wide";
}

}  // namespace
}  // namespace vest::effects

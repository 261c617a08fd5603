// Seeping of cut surfaces: growth, styptic, heat, pressure, washing, and the account of volume.

#include <gtest/gtest.h>

#include <cmath>

#include "vest_effects/bleeding/surface.h"

using namespace vest::bleeding;

namespace {

/// A sheet of 21 × 21 knots, 2 mm apart: 1 g of uterus to a knot's cm².
struct Sheet {
  SurfaceModel model;
  SurfaceState state;
  SurfaceInputs inputs;
  std::vector<float> xyz;
  const float* rows[1];
  Sheet() {
    const int n = 21;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        xyz.insert(xyz.end(), {0.002f * i, 0.002f * j, 0.0f});
        const auto k = static_cast<std::uint32_t>(j * n + i);
        if (i + 1 < n) model.link0.push_back(k), model.link1.push_back(k + 1);
        if (j + 1 < n) model.link0.push_back(k), model.link1.push_back(k + n);
      }
    const std::size_t room = n * n + 8;
    xyz.resize(3 * room, 0.02f);
    model.first = {0, static_cast<std::uint32_t>(room)};
    model.scene = {n * n};
    model.area.assign(room, 4e-6);
    model.supply.assign(room, supplyOf("uterus") * 4e-5);
    state = initialSurface(model);
    rows[0] = xyz.data();
    inputs.positions = rows;
  }
  Eigen::Vector3d centre() const { return {0.02, 0.02, 0}; }
  void cut(double reach = 0.003) { openSurface(model, 0, rows[0], centre(), reach, state); }
  /// Volume seeped in so many seconds.
  double seconds(double t) {
    const double before = state.seeped;
    for (int i = 0; i < static_cast<int>(t * 1000 + 0.5); ++i) {
      SurfaceRunoff runoff;
      const double shed = state.shed;
      stepSurface(model, inputs, 1e-3, state, &runoff);
      EXPECT_NEAR(runoff.volume, state.shed - shed, 1e-12 * state.shed + 1e-20);
    }
    EXPECT_NEAR(state.seeped, filmVolume(model, state) + state.shed, 1e-6 * state.seeped + 1e-18);
    return state.seeped - before;
  }
  int wet() const {
    int count = 0;
    for (double f : state.film) count += wetness(f) > 0.2f;
    return count;
  }
};

}  // namespace

TEST(Surface, WholeTissueIsDryAndACutSeepsAndItsStainGrows) {
  Sheet s;
  EXPECT_EQ(s.seconds(1), 0);
  s.cut();
  const double first = s.seconds(5);
  const int early = s.wet();
  s.seconds(25);
  std::printf("seeping: %.3f ml/min; stain of %d, then %d knots\n", 6e7 * first / 5, early, s.wet());
  EXPECT_NEAR(first, 5 * 9 * s.model.supply[0], 0.1 * first);  // 9 knots within 3 mm
  EXPECT_GT(s.wet(), early + 5);
}

TEST(Surface, StypticByTheNeedleStopsItAndLasts) {
  Sheet s;
  s.cut();
  const double open = s.seconds(1);
  s.inputs.inject[2] = {true, s.centre()};
  s.seconds(6);
  s.inputs.inject[2].on = false;
  EXPECT_LT(s.seconds(1), 0.1 * open);
  s.seconds(20);
  EXPECT_LT(s.seconds(1), 0.1 * open);
}

TEST(Surface, TheDrugFillsASphereOfTissueThatGrowsWithTheVolumeInjected) {
  Sheet s;
  s.cut(0.02);
  s.inputs.inject[1] = {true, s.centre()};
  const auto reached = [&] {
    double far = 0;
    for (std::size_t k = 0; k < 21 * 21; ++k)
      if (s.state.drug[k] > 0.5f)
        far = std::max(far, std::hypot(s.xyz[3 * k] - 0.02, s.xyz[3 * k + 1] - 0.02));
    return far;
  };
  s.seconds(0.5);
  const double radius = std::cbrt(3 * 0.5 * kInjectionFlow / (4 * 3.14159265358979 * kInterstice));
  EXPECT_LE(reached(), radius);
  EXPECT_GT(reached(), radius - 0.002) << "m: knots lie 2 mm apart";
  s.seconds(3.5);
  EXPECT_LE(reached(), 2 * radius);
  EXPECT_GT(reached(), 2 * radius - 0.002) << "eight times the volume, twice the radius";
}

TEST(Surface, InjectionFarAwayDoesNothing) {
  Sheet s, t;
  s.cut(), t.cut();
  t.inputs.inject[0] = {true, s.centre() + Eigen::Vector3d(0.02, 0, 0)};
  EXPECT_EQ(s.seconds(2), t.seconds(2));
}

TEST(Surface, HeatSealsAsMuchAreaAsItsEnergyAllows) {
  Sheet s;
  s.cut();
  const double open = s.seconds(1);
  const double needed = 9 * 4e-6 * kSealHeat;
  sealSurface(s.model, 0, s.rows[0], s.centre(), 0.5 * needed, s.state);
  const double half = s.seconds(1);
  EXPECT_NEAR(half, 0.5 * open, 0.1 * open);
  sealSurface(s.model, 0, s.rows[0], s.centre(), 0.6 * needed, s.state);
  EXPECT_EQ(s.seconds(1), 0);
  s.cut();  // cut again: what was sealed bleeds again
  EXPECT_GT(s.seconds(1), 0.9 * open);
}

TEST(Surface, PressureStopsItWhileItLastsAndLetsItClot) {
  Sheet s;
  s.cut();
  const double open = s.seconds(1);
  s.inputs.press[1] = {true, s.centre()};
  EXPECT_EQ(s.seconds(20), 0);
  s.inputs.press[1].on = false;
  const double after = s.seconds(1);
  EXPECT_GT(after, 0);
  EXPECT_LT(after, 0.8 * open);
}

TEST(Surface, IrrigationWashesTheStainOffAndNothingOfItIsLost) {
  Sheet s;
  s.cut();
  s.seconds(20);
  sealSurface(s.model, 0, s.rows[0], s.centre(), 1e3, s.state);
  const int before = s.wet();
  ASSERT_GT(before, 10);
  // A jet's 20 Pa on 0.1 mm of film: h/(1 + tau h t/(2 mu √A)) halves in some 10 ms at the middle.
  const auto k = static_cast<std::uint32_t>(10 * 21 + 10);
  const double film = s.state.film[k], stress = 20, t = 0.05;
  for (int i = 0; i < 50; ++i)
    washSurface(s.model, 0, s.rows[0], {k, k + 1, k + 21}, stress * 4e-6 * 3 * t / 50, s.state);
  EXPECT_NEAR(s.state.film[k], film / (1 + stress * film * t / (2 * kFilmViscosity * 2e-3)), 1e-9 * film);
  s.seconds(0.001);
  for (int i = 0; i < 100; ++i) {
    for (std::uint32_t j = 0; j < 20 * 21; ++j)
      if (j % 21 != 20) washSurface(s.model, 0, s.rows[0], {j, j + 1, j + 21}, stress * 4e-6 * 0.02, s.state);
    s.seconds(0.001);
  }
  EXPECT_LT(s.wet(), before / 4);
}

TEST(Surface, FullFilmRunsOffAndLowPressureSeepsLess) {
  Sheet s;
  s.inputs.scale = 100;
  s.cut();
  s.seconds(30);
  EXPECT_GT(s.state.shed, 0.3 * s.state.seeped);
  for (double f : s.state.film) EXPECT_LE(f, kFullFilm * 1.01);
  Sheet low;
  low.inputs.pressure_ratio = 0.5;
  low.cut();
  Sheet rest;
  rest.cut();
  EXPECT_NEAR(low.seconds(1), 0.5 * rest.seconds(1), 1e-6 * rest.state.seeped + 1e-12);
}

TEST(Surface, CopiesOfKnotsBleedLikeTheirOriginalsWhileThereIsRoom) {
  Sheet s;
  s.cut();
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(copyKnot(s.model, 0, 10 * 21 + 10, s.state));
  EXPECT_FALSE(copyKnot(s.model, 0, 10 * 21 + 10, s.state));
  EXPECT_EQ(s.state.open[21 * 21], 1.0f);
  s.seconds(0.1);
  EXPECT_GT(s.state.flow[21 * 21], 0.0f);
}

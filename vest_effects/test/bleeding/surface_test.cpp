// Seeping of cut surfaces: growth, styptic, heat, pressure, washing, and the account of volume.

#include <gtest/gtest.h>

#include <cmath>

#include "vest_effects/bleeding/surface.h"
#include "vest_effects/bleeding/swab.h"

using namespace vest::bleeding;

namespace {

constexpr double kPerfusion = 0.0045;  ///< 1/s: as a uterus

/// A sheet of 21 × 21 knots, 2 mm apart and 10 mm thick; level, or hung up by the edge of great y.
struct Sheet {
  SurfaceModel model;
  SurfaceState state;
  SurfaceInputs inputs;
  std::vector<float> xyz;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  SurfaceMesh mesh;
  explicit Sheet(bool upright = false) {
    const std::uint32_t n = 21;
    for (std::uint32_t j = 0; j < n; ++j)
      for (std::uint32_t i = 0; i < n; ++i) {
        const float along = 0.002f * static_cast<float>(j);
        xyz.insert(xyz.end(),
                   {0.002f * static_cast<float>(i), upright ? 0.0f : along, upright ? along : 0.0f});
        if (i + 1 == n || j + 1 == n) continue;
        const std::uint32_t k = j * n + i;
        triangles.push_back({k, k + 1, k + n}), triangles.push_back({k + 1, k + n + 1, k + n});
      }
    const std::size_t room = n * n + 8;
    xyz.resize(3 * room, 0.02f);
    model.first = {0, static_cast<std::uint32_t>(room)};
    model.scene = {n * n};
    model.perfusion.assign(room, kPerfusion);
    model.depth.assign(room, 0.01);
    state = initialSurface(model);
    mesh = {xyz.data(), triangles.data(), nullptr, triangles.size()};
    measureSurface(model, 0, mesh, xyz.data(), state);
    inputs.meshes = &mesh;
  }
  Eigen::Vector3d centre() const { return {0.02, 0.02, 0}; }
  void cut(double reach = 0.003) { openSurface(model, 0, xyz.data(), centre(), reach, state); }
  /// Volume seeped in so many seconds.
  double seconds(double t) {
    const double before = state.seeped;
    const double dt = t < 0.1 ? 1e-3 : t < 100 ? 1e-2 : 2e-2;
    SurfaceRunoff runoff(model);
    for (int i = 0; i < static_cast<int>(t / dt + 0.5); ++i) {
      const double shed = state.shed;
      stepSurface(model, inputs, dt, state, runoff);
      EXPECT_NEAR(runoff.volume(), state.shed - shed, 1e-12 * state.shed + 1e-20);
    }
    EXPECT_NEAR(state.seeped + state.stained, filmVolume(state) + state.shed + state.wiped,
                1e-9 * state.seeped + 1e-18);
    return state.seeped - before;
  }
  int wet() const {
    int count = 0;
    for (std::size_t k = 0; k < state.film.size(); ++k) count += wetness(thickness(state, k)) > 0.2f;
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
  EXPECT_NEAR(first, 5 * 9 * 4e-6 * 0.01 * kPerfusion, 0.1 * first);  // 9 knots within 3 mm
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
  sealSurface(s.model, 0, s.xyz.data(), s.centre(), 0.5 * needed, s.state);
  const double half = s.seconds(1);
  EXPECT_NEAR(half, 0.5 * open, 0.1 * open);
  sealSurface(s.model, 0, s.xyz.data(), s.centre(), 0.6 * needed, s.state);
  EXPECT_EQ(s.seconds(1), 0);
  s.cut();  // cut again: what was sealed bleeds again
  EXPECT_GT(s.seconds(1), 0.9 * open);
}

TEST(Surface, PressureStopsItWhileItLastsAndLetsItClot) {
  Sheet s;
  s.cut();
  const double open = s.seconds(1);
  s.inputs.press[1] = {true, s.centre(), 0, kPressReach};
  EXPECT_EQ(s.seconds(20), 0);
  s.inputs.press[1].on = false;
  const double after = s.seconds(1);
  EXPECT_GT(after, 0);
  EXPECT_LT(after, 0.8 * open);
}

TEST(Surface, GauzeWipesFreshFilmsUntilItIsFullAndLeavesWhatHasSet) {
  Sheet s;
  s.cut();
  s.seconds(20);
  const double film = filmVolume(s.state);
  const auto wipe = [&](double seconds, double room) {
    const double most = s.state.wiped + room;
    for (int i = 0; i < static_cast<int>(100 * seconds + 0.5); ++i) {
      s.inputs.gauze[2] = {s.centre(), std::max(0.0, most - s.state.wiped)};
      s.seconds(0.01);
    }
  };
  s.inputs.press[2] = {true, s.centre(), 0, kSwabReach};
  wipe(kSwabTime, 0.25 * film);
  EXPECT_NEAR(s.state.wiped, 0.25 * film, 0.01 * film) << "full";
  wipe(8 * kSwabTime, 1e-6);  // its rim presses less
  EXPECT_LT(filmVolume(s.state), 0.2 * film) << "wiped clean, but for what ran out of its reach";
  s.inputs.gauze[2].room = 0;
  s.inputs.press[2].on = false;
  s.cut();
  s.seconds(20);
  std::fill(s.state.age.begin(), s.state.age.end(), 6 * static_cast<float>(kSettingTime));
  s.state.open.assign(s.state.open.size(), 0.0f);
  const double set = filmVolume(s.state), wiped = s.state.wiped;
  s.inputs.gauze[2].room = 1e-6;
  s.seconds(3);
  EXPECT_LT(s.state.wiped - wiped, 0.01 * set) << "a clot stays";
}

// Protects that a swab wipes where it presses: more in the middle than towards the rim, and nothing beside
// the patch, which grows with its force as Hertz says. (It wiped evenly over its whole reach, however lightly
// held.)
TEST(Surface, GauzeWipesAsItPressesMostInTheMiddle) {
  // a³ = 3FR/(4E*) by hand: 1 N on a wad of 7 mm and 10 kPa makes 8.07 mm.
  EXPECT_NEAR(pressedRadius(1, 0.007), 0.00807, 1e-5);
  EXPECT_NEAR(pressedRadius(0.5, 0.007) / pressedRadius(0.25, 0.007), std::cbrt(2.0), 1e-6);
  EXPECT_EQ(pressedRadius(0, 0.007), kSwabTouch);
  EXPECT_EQ(pressedRadius(100, 0.007), kSwabReach);
  const auto left = [](double patch) {
    Sheet s;
    for (std::size_t k = 0; k < 441; ++k) s.state.film[k] = 1e-10;
    s.state.active = 1, s.state.dry.assign(s.state.dry.size(), 0);
    s.inputs.gravity = {0, 0, -1e-9};
    s.state.stained = 441e-10;
    s.inputs.gauze[1] = {s.centre(), 1e-6, patch};
    s.seconds(0.5);
    return s.state.film;
  };
  const auto film = left(0.008);
  const std::size_t middle = 10 * 21 + 10;  // 2 mm from knot to knot
  EXPECT_LT(film[middle], 0.9e-10);
  EXPECT_GT(film[middle + 3], film[middle]);
  EXPECT_NEAR((1e-10 - film[middle + 3]) / (1e-10 - film[middle]), std::sqrt(1 - 36.0 / 64), 0.05);
  EXPECT_GT(film[middle + 5], 0.999e-10) << "beside the patch";
  EXPECT_LT(left(0.010)[middle + 4], 0.95e-10) << "pressed harder it is wider";
}

TEST(Surface, IrrigationWashesTheStainOffAndNothingOfItIsLost) {
  Sheet s;
  s.cut();
  s.seconds(20);
  sealSurface(s.model, 0, s.xyz.data(), s.centre(), 1e3, s.state);
  const int before = s.wet();
  ASSERT_GT(before, 10);
  // A jet's 20 Pa on 0.1 mm of film: h/(1 + tau h t/(2 mu √A)) halves in some 10 ms at the middle.
  const auto k = static_cast<std::uint32_t>(10 * 21 + 10);
  const double film = thickness(s.state, k), stress = 20, t = 0.05;
  for (int i = 0; i < 50; ++i)
    washSurface(s.model, 0, {k, k + 1, k + 21}, stress * 4e-6 * 3 * t / 50, s.state);
  EXPECT_NEAR(thickness(s.state, k), film / (1 + stress * film * t / (2 * kFilmViscosity * 2e-3)),
              1e-6 * film);
  s.seconds(0.001);
  for (int i = 0; i < 100; ++i) {
    for (std::uint32_t j = 0; j < 20 * 21; ++j)
      if (j % 21 != 20) washSurface(s.model, 0, {j, j + 1, j + 21}, stress * 4e-6 * 0.02, s.state);
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
  for (std::size_t k = 0; k < s.state.film.size(); ++k) EXPECT_LE(thickness(s.state, k), kFullFilm * 1.01);
  Sheet low;
  const double half = 0.5;
  low.inputs.perfused = &half;
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

TEST(Surface, StypticInjectedBeforeTheIncisionWorksWhereItWasInjected) {
  Sheet s, bare;
  s.inputs.inject[0] = {true, s.centre()};
  s.seconds(6);
  s.inputs.inject[0].on = false;
  s.seconds(20);
  s.cut(), bare.cut();
  EXPECT_LT(s.seconds(5), 0.05 * bare.seconds(5));
  // And no farther than it came.
  const Eigen::Vector3d far(0.004, 0.004, 0);
  openSurface(s.model, 0, s.xyz.data(), far, 0.003, s.state);
  EXPECT_GT(s.seconds(1), 0.5 * 4e-6 * 0.01 * kPerfusion);
}

TEST(Surface, EachWoundDripsFromItsOwnLowestPlace) {
  Sheet s(true);
  s.inputs.scale = 100;
  const Eigen::Vector3d left(0.006, 0, 0.03), right(0.034, 0, 0.03);
  for (const auto& place : {left, right}) openSurface(s.model, 0, s.xyz.data(), place, 0.003, s.state);
  double at_left = 0, at_right = 0, elsewhere = 0;
  SurfaceRunoff runoff(s.model);
  for (int i = 0; i < 10000; ++i) {
    stepSurface(s.model, s.inputs, 4e-3, s.state, runoff);
    for (const auto& fall : runoff.falls) {
      const bool low = fall.place.z() < 0.001;
      double& to = low && std::fabs(fall.place.x() - left.x()) < 0.006    ? at_left
                   : low && std::fabs(fall.place.x() - right.x()) < 0.006 ? at_right
                                                                          : elsewhere;
      if (fall.volume > 0) to += fall.volume;
    }
  }
  std::printf("%.3f ml left, %.3f ml right, %.3f ml elsewhere\n", 1e6 * at_left, 1e6 * at_right,
              1e6 * elsewhere);
  EXPECT_GT(at_left, 0.3 * s.state.shed);
  EXPECT_GT(at_right, 0.3 * s.state.shed);
  EXPECT_LT(elsewhere, 0.2 * s.state.shed);
}

TEST(Surface, ItsObjectsRunInAnyOrder) {
  // Threads share them out: each is on its own from the seeping to the dripping, to the last bit.
  Sheet one(true);
  SurfaceModel model = one.model;
  const auto room = static_cast<std::uint32_t>(model.knots());
  for (int k = 1; k < 3; ++k)
    model.first.push_back(model.first.back() + room), model.scene.push_back(model.scene[0]);
  model.perfusion.assign(3 * room, kPerfusion), model.depth.assign(3 * room, 0.01);
  const std::array<SurfaceMesh, 3> meshes{one.mesh, one.mesh, one.mesh};
  SurfaceState whole = initialSurface(model);
  SurfaceInputs inputs;
  inputs.meshes = meshes.data(), inputs.scale = 100;
  for (std::size_t k = 0; k < 3; ++k) {
    measureSurface(model, k, meshes[k], one.xyz.data(), whole);
    openSurface(model, k, one.xyz.data(), {0.01 + 0.005 * static_cast<double>(k), 0, 0.03}, 0.003, whole);
  }
  SurfaceState parts = whole;
  SurfaceRunoff off(model), off_parts(model);
  for (int i = 0; i < 3000; ++i) {
    stepSurface(model, inputs, 4e-3, whole, off);
    if (seepSurface(model, inputs, 4e-3, parts, off_parts))
      for (const std::size_t object : {2u, 0u, 1u}) runSurface(model, inputs, 4e-3, object, parts, off_parts);
    dripSurface(model, inputs, parts, off_parts);
  }
  EXPECT_GT(whole.shed, 0) << "they drip";
  EXPECT_EQ(whole.shed, parts.shed);
  EXPECT_EQ(whole.film, parts.film);
  EXPECT_EQ(whole.age, parts.age);
  EXPECT_EQ(off.volume(), off_parts.volume());
}

TEST(Surface, AStainRunsDownAsNusseltSaysThinsOutAndSets) {
  // The front of a strip of film on an upright wall falls with rho g h²/(3 mu) (Huppert 1982 gives its end).
  const auto middle = [](const Sheet& s) {
    double sum = 0, moment = 0;
    for (std::size_t k = 0; k < 21 * 21; ++k)
      sum += s.state.film[k], moment += s.state.film[k] * s.xyz[3 * k + 2];
    return moment / sum;
  };
  const auto stain = [](Sheet& s, double film) {
    for (std::uint32_t row = 14; row < 17; ++row)
      for (std::uint32_t i = 0; i + 1 < 21; ++i)
        stainSurface(s.model, 0, {row * 21 + i, row * 21 + i + 1, (row + 1) * 21 + i}, film * 4e-6, s.state);
  };
  Sheet s(true), old(true);
  stain(s, 1e-4), stain(old, 1e-4);
  const double start = middle(s);
  s.seconds(0.5);
  const double fast = start - middle(s), before = middle(s);
  s.seconds(5);
  const double slow = (before - middle(s)) / 10;
  std::printf("a film of 0.1 mm falls %.1f mm in half a second, thinned out %.1f mm\n", 1e3 * fast,
              1e3 * slow);
  const double speed = kFilmDensity * 9.81 * 1e-8 / (3 * kFilmViscosity);
  EXPECT_GT(fast, 0.25 * speed * 0.5);
  EXPECT_LT(fast, 1.2 * speed * 0.5);
  EXPECT_LT(slow, 0.5 * fast) << "a thin film hardly runs";
  for (auto& age : old.state.age) age = 1200;
  old.seconds(0.5);
  EXPECT_LT(start - middle(old), 0.1 * fast) << "clotted";
  EXPECT_GT(old.state.age[15 * 21 + 5], 1200);
}

TEST(Surface, AFilmDriesAtItsThinRimFirstAndLosesNoBlood) {
  Sheet s;
  s.inputs.drying = 1.5e-7;  // m/s: dry gas at 37 °C (Gas.AWetSurfaceDriesAsChiltonAndColburnSay)
  const std::size_t middle = 5 * 21 + 5, rim = 17 * 21 + 17;  // too far apart to flow from one to the other
  for (std::size_t j = 1; j < 10; ++j)
    for (std::size_t i = 1; i < 10; ++i) s.state.film[j * 21 + i] = 1e-4 * s.state.area[j * 21 + i];
  s.state.film[rim] = 2.4e-6 * s.state.area[rim];
  s.state.stained = filmVolume(s.state), s.state.active = 1;
  s.seconds(20);
  EXPECT_GT(setShare(s.state.age[rim]), 0.9f) << "all of its water has gone after 13 s";
  EXPECT_LT(setShare(s.state.age[middle]), 0.05f);
  EXPECT_NEAR(s.state.film[rim], 2.4e-6 * s.state.area[rim], 1e-9 * s.state.film[rim])
      << "cells and salt stay";
}

TEST(Surface, AFilmThinnerThanARedCellStaysWhereItIs) {
  Sheet s(true);
  s.inputs.gravity = {0, 0, -9.81};
  const std::uint32_t knot = 10 * 21 + 10;
  const auto spread = [&](double thick) {
    s.state = initialSurface(s.model);
    measureSurface(s.model, 0, s.mesh, s.xyz.data(), s.state);
    stainSurface(s.model, 0, {knot, knot, knot}, thick * static_cast<double>(s.state.area[knot]), s.state);
    s.seconds(20);
    std::size_t stained = 0;
    for (const double film : s.state.film) stained += film > 0;
    return stained;
  };
  EXPECT_EQ(spread(0.9 * kThinFilm), 1u);
  // One that runs reddens its way, not the whole sheet by traces.
  const std::size_t run = spread(1e-4);
  EXPECT_GT(run, 5u);
  EXPECT_LT(run, 100u);
}

TEST(Surface, ASuckerTakesTheClotAndItBleedsAgain) {
  Sheet s;
  s.cut();
  const double fresh = s.seconds(1);
  s.inputs.press[0] = {true, s.centre(), 0, kPressReach};
  s.seconds(300);
  s.inputs.press[0].on = false;
  EXPECT_LT(s.seconds(1), 0.02 * fresh) << "the clot holds";
  double clots = 0;
  for (std::size_t i = 0; i < s.state.clot.size(); ++i)
    clots += static_cast<double>(s.state.clot[i]) * static_cast<double>(s.state.area[i]) * kClotThickness;
  s.inputs.suck[1] = {true, s.centre(), 0, kSuckReach};
  SurfaceRunoff runoff(s.model);
  stepSurface(s.model, s.inputs, 0.001, s.state, runoff);
  EXPECT_GT(runoff.clots[1], 0.3 * clots) << "what it took goes to the second sucker";
  EXPECT_LE(runoff.clots[1], 1.001 * clots);
  EXPECT_EQ(runoff.clots[0], 0);
  EXPECT_GT(s.seconds(1), 0.8 * fresh);
}

TEST(Surface, AFaceThatACutOpenedBleedsByItsArea) {
  Sheet s;
  SurfaceMesh whole = s.mesh, half = s.mesh;
  half.triangle_count = 400;
  measureSurface(s.model, 0, half, s.xyz.data(), s.state);
  const auto surface = [&] {
    double sum = 0;
    for (const float a : s.state.area) sum += static_cast<double>(a);
    return sum;
  };
  EXPECT_NEAR(surface(), 400 * 2e-6, 1e-9);
  stainSurface(s.model, 0, {0, 1, 21}, 1e-9, s.state);
  measureSurface(s.model, 0, whole, s.xyz.data(), s.state);
  for (std::size_t t = 400; t < whole.triangle_count; ++t) openFace(s.model, 0, s.triangles[t], s.state);
  const double seeped = s.seconds(1);
  EXPECT_NEAR(seeped, kPerfusion * 0.01 * 400 * 2e-6, 0.1 * seeped);
  half.triangle_count = 0;  // its surface goes: what stood on it drips
  measureSurface(s.model, 0, half, s.xyz.data(), s.state);
  EXPECT_NEAR(filmVolume(s.state) + s.state.shed, s.state.seeped + s.state.stained, 1e-15);
  s.seconds(0.01);
  EXPECT_NEAR(s.state.shed, s.state.seeped + s.state.stained, 1e-12 * s.state.shed);
}

TEST(Surface, ThinLayersShowAsBeerAndLambertSay) {
  EXPECT_EQ(wetness(0), 0.0f);
  EXPECT_NEAR(wetness(kClearFilm), 1 - std::exp(-1.0), 1e-6);
  EXPECT_NEAR(wetness(1e-6), 1e-6 / kClearFilm, 5e-4) << "a micrometre is a tinge, not nothing";
  EXPECT_GT(wetness(kFullFilm), 0.999f);
}

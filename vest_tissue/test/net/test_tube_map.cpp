#include <gtest/gtest.h>

#include <cmath>

#include "nets.h"
#include "vest_tissue/net/tube_map.h"
#include "vest_tissue/scene/roles.h"

namespace {

using namespace vest;

net::TubeMap tubeMap() {
  const scene::Object t = specimen::tube({});  // 16 rings of 8 knots over 0.1 m
  return net::TubeMap(t.tube.station, t.tube.rings, "uterine_artery", t.position.size() + 1);
}

TEST(TubeMap, StationRingAndKnotsLeadToEachOther) {
  const net::TubeMap m = tubeMap();
  ASSERT_EQ(m.ringCount(), 16u);
  EXPECT_EQ(m.segment(), "uterine_artery");
  EXPECT_DOUBLE_EQ(m.length(), 0.1);
  for (std::size_t r = 0; r < m.ringCount(); ++r) {
    EXPECT_EQ(m.nearestRing(m.station(r)), r);
    for (const auto k : m.knots(r)) {
      EXPECT_EQ(m.ringOf(k), static_cast<std::int32_t>(r));
      EXPECT_EQ(m.stationOf(k), m.station(r));
    }
  }
  EXPECT_EQ(m.ringOf(128), -1) << "a knot on no ring";
  EXPECT_EQ(m.ringOf(100000), -1);
  EXPECT_TRUE(std::isnan(m.stationOf(128)));
}

TEST(TubeMap, PlacesBetweenRingsAreInterpolatedAndEndsHold) {
  const net::TubeMap m = tubeMap();
  const double pitch = 0.1 / 15;
  const auto p = m.at(3.25 * pitch);
  EXPECT_EQ(p.ring, 3u);
  EXPECT_NEAR(p.fraction, 0.25, 1e-9);
  EXPECT_EQ(m.nearestRing(3.75 * pitch), 4u);
  EXPECT_EQ(m.nearestRing(-1), 0u);
  EXPECT_EQ(m.nearestRing(5), 15u);
  EXPECT_NEAR(m.stationAt({0, 8, 8}, {0.5, 0.25, 0.25}), 0.5 * pitch, 1e-12);
  EXPECT_NEAR(m.stationAt({0, 128, 8}, {0.25, 0.5, 0.25}), 0.5 * pitch, 1e-12)
      << "knots on no ring do not count";
  EXPECT_TRUE(std::isnan(m.stationAt({128, 128, 128}, {1, 0, 0})));
  EXPECT_TRUE(std::isnan(net::TubeMap().stationOf(0)));
}

TEST(TubeMap, RefusesWhatCannotBeLookedUp) {
  EXPECT_THROW(net::TubeMap({0, 1}, {{0}}, "", 4), std::invalid_argument);
  EXPECT_THROW(net::TubeMap({1, 0}, {{0}, {1}}, "", 4), std::invalid_argument);
  EXPECT_THROW(net::TubeMap({0, NAN}, {{0}, {1}}, "", 4), std::invalid_argument);
  EXPECT_THROW(net::TubeMap({0, 1}, {{0}, {4}}, "", 4), std::invalid_argument);
}

TEST(Roles, ObjectsAreFoundByRoleAndByVesselSegment) {
  scene::Description d = specimen::seedSizeScene(false);
  d.objects[2].roles = {"target"};
  d.objects[5].roles = {"forbidden", "target"};
  d.objects[7].tube.vessel_segment = d.objects[3].tube.vessel_segment = "ovarian_vein";
  EXPECT_EQ(scene::objectsWithRole(d, "target"), (std::vector<std::size_t>{2, 5}));
  EXPECT_EQ(scene::objectsWithRole(d, "forbidden"), (std::vector<std::size_t>{5}));
  EXPECT_TRUE(scene::objectsWithRole(d, "tar").empty());
  EXPECT_FALSE(scene::hasRole(d.objects[2], "forbidden"));
  EXPECT_EQ(scene::objectsOfSegment(d, "ovarian_vein"), (std::vector<std::size_t>{3, 7}));
  EXPECT_TRUE(scene::objectsOfSegment(d, "").empty());
}

}  // namespace

// Protects the lines of an exercise: they go with the tissue, and garbage is left out.
#include <gtest/gtest.h>

#include <cmath>

#include "conversion.h"
#include "sheet.h"
#include "targets.h"

namespace vest::displays {
namespace {

visualization_msgs::Marker circle(const std::string& object) {
  visualization_msgs::Marker line;
  line.type = visualization_msgs::Marker::LINE_STRIP;
  line.ns = object;
  for (int i = 0; i <= 32; ++i) {
    geometry_msgs::Point p;
    p.x = 0.008 * std::cos(2 * M_PI * i / 32), p.y = 0.008 * std::sin(2 * M_PI * i / 32), p.z = 0.0003;
    line.points.push_back(p);
  }
  return line;
}

Eigen::Vector3f middle(const instrument::TriangleMesh& mesh) {
  const Eigen::Map<const Eigen::Matrix3Xf> points(mesh.positions.data(), 3,
                                                  static_cast<Eigen::Index>(mesh.positions.size() / 3));
  return points.rowwise().mean();
}

TEST(Targets, GoWithTheKnotsThatTheyLieOn) {
  mesh::Store store;
  ASSERT_EQ(store.setTopology(toTopology(sheet("uterus"))), mesh::Outcome::Accepted);
  visualization_msgs::MarkerArray markers;
  markers.markers = {circle("uterus")};
  Targets targets;
  targets.set(markers);
  EXPECT_LT(middle(targets.mesh(store)).norm(), 5e-4);
  std::vector<float> moved = store.topology().objects[0].rest_position;
  for (std::size_t i = 0; i < moved.size(); i += 3) moved[i] += 0.004f;
  ASSERT_EQ(store.setState(1, moved.data(), moved.size()), mesh::Outcome::Accepted);
  EXPECT_NEAR(middle(targets.mesh(store)).x(), 0.004, 5e-4);
  targets.set({});
  EXPECT_TRUE(targets.mesh(store).triangles.empty());
}

TEST(Targets, WhatIsNotFiniteOrHasNoObjectIsLeftOut) {
  mesh::Store store;
  Targets targets;
  visualization_msgs::MarkerArray markers;
  markers.markers = {circle("nothing"), circle("uterus"), circle("uterus"), circle("uterus")};
  markers.markers[1].points[5].x = NAN;
  markers.markers[2].points.resize(2);
  markers.markers[3].points.resize(100000);
  targets.set(markers);
  EXPECT_TRUE(targets.mesh(store).triangles.empty()) << "no tissue yet";
  ASSERT_EQ(store.setTopology(toTopology(sheet("uterus"))), mesh::Outcome::Accepted);
  EXPECT_TRUE(targets.mesh(store).triangles.empty());
}

}  // namespace
}  // namespace vest::displays

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "vest_viz/mesh/unfold.h"

namespace vest::mesh {
namespace {

/// Sphere of 10 cm seen from inside, meridians along x; its own coordinates pinch at both ends.
Object ball() {
  Object o;
  o.name = o.organ = "cavity";
  o.rigid = true;
  const std::uint32_t rows = 24, columns = 40;
  for (std::uint32_t i = 0; i <= rows; ++i)
    for (std::uint32_t j = 0; j <= columns; ++j) {
      const float a = 3.14159265f * i / rows, b = 2 * 3.14159265f * j / columns;
      o.rest_position.insert(o.rest_position.end(), {0.1f * std::cos(a), 0.1f * std::sin(a) * std::cos(b),
                                                     0.1f * std::sin(a) * std::sin(b)});
      o.texture_coordinates.insert(o.texture_coordinates.end(), {0.1f * a, 0.1f * b});
      o.binding_start.push_back(o.knot_count);
      o.binding_knots.push_back(o.knot_count++);
      o.binding_weights.push_back(1);
      if (i == rows || j == columns) continue;
      const std::uint32_t k = i * (columns + 1) + j, down = k + columns + 1;
      o.triangles.insert(o.triangles.end(), {k, down + 1, down, k, k + 1, down + 1});
    }
  o.binding_start.push_back(o.knot_count);
  return o;
}

/// Angle of a triangle's middle from the pole, and how its edges and its area are stretched on the plane.
template <class F>
void eachTriangle(const Object& o, F f) {
  for (std::size_t t = 0; t < o.triangles.size(); t += 3) {
    double middle[3] = {0, 0, 0}, low = 1e9, high = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = o.triangles[t + k], b = o.triangles[t + (k + 1) % 3];
      double l2 = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        middle[i] += o.rest_position[3 * a + i];
        l2 += std::pow(o.rest_position[3 * a + i] - o.rest_position[3 * b + i], 2);
      }
      if (l2 < 1e-10) continue;  // at the sphere's own ends
      const double l = std::hypot(o.texture_coordinates[2 * a] - o.texture_coordinates[2 * b],
                                  o.texture_coordinates[2 * a + 1] - o.texture_coordinates[2 * b + 1]);
      low = std::min(low, l / std::sqrt(l2));
      high = std::max(high, l / std::sqrt(l2));
    }
    double along = 0, norm = 0;
    for (std::size_t i = 0; i < 3; ++i) along += middle[i] * kPelvicPole[i], norm += middle[i] * middle[i];
    f(std::acos(along / std::sqrt(norm)), low, high);
  }
}

TEST(Unfold, EdgesInViewKeepTheirLength) {
  Object o = ball();
  unfold(&o, kPelvicPole);
  int seen = 0;
  eachTriangle(o, [&](double angle, double low, double high) {
    if (angle > 1.2) return;  // 70 degrees: beyond what a picture shows
    ++seen;
    EXPECT_GT(low, 0.7);
    EXPECT_LT(high, 1.45);
  });
  EXPECT_GT(seen, 300);
}

TEST(Unfold, VerticesAtOnePlaceGetOneCoordinate) {
  Object o = ball();
  unfold(&o, kPelvicPole);
  for (std::size_t i = 0; i <= 24; ++i)
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_EQ(o.texture_coordinates[2 * (i * 41) + k], o.texture_coordinates[2 * (i * 41 + 40) + k]);
}

TEST(Unfold, ObjectWithoutTrianglesIsLeftAlone) {
  Object o;
  unfold(&o, kPelvicPole);
  EXPECT_TRUE(o.texture_coordinates.empty());
}

}  // namespace
}  // namespace vest::mesh

// Protects cuts from a tree that finds other triangles than a look at each would: opposite and nearest ones
// decide where a cut goes, to the bit.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "../../src/verbs/triangle_tree.h"
#include "vest_tissue/base/nearest.h"

using namespace vest;
using Eigen::Vector3d;
using scene::TriangleTree;

namespace {

using Triangles = std::vector<TriangleTree::Triangle>;

struct Surface {
  std::vector<Vector3d> x;
  Triangles triangles;
};

/// A block's six sides as a lattice, so that many triangles are equally near; with `noise` of its cells.
Surface block(int n, double noise) {
  Surface s;
  std::uint64_t state = 1;
  const auto random = [&] {
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    return static_cast<double>(state >> 40) / (1 << 24) - 0.5;
  };
  for (int side = 0; side < 6; ++side) {
    const auto first = static_cast<std::uint32_t>(s.x.size());
    const auto row = static_cast<std::uint32_t>(n + 1);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        Vector3d p;
        p[side % 3] = side < 3 ? 0.0 : 1.0;
        p[(side + 1) % 3] = static_cast<double>(i) / n, p[(side + 2) % 3] = static_cast<double>(j) / n;
        s.x.push_back(p + noise / n * Vector3d(random(), random(), random()));
      }
    for (std::uint32_t j = 0; j + 1 < row; ++j)
      for (std::uint32_t i = 0; i + 1 < row; ++i) {
        const std::uint32_t a = first + j * row + i;
        s.triangles.push_back({a, a + 1, a + row}), s.triangles.push_back({a + 1, a + row + 1, a + row});
        if (side < 3)
          for (std::size_t k = s.triangles.size() - 2; k < s.triangles.size(); ++k)
            std::swap(s.triangles[k][1], s.triangles[k][2]);
      }
  }
  return s;
}

Vector3d centreOf(const Surface& s, const TriangleTree::Triangle& t) {
  return (s.x[t[0]] + s.x[t[1]] + s.x[t[2]]) / 3.0;
}
Vector3d normalOf(const Surface& s, const TriangleTree::Triangle& t) {
  return (s.x[t[1]] - s.x[t[0]]).cross(s.x[t[2]] - s.x[t[0]]);
}

std::uint32_t eachBehind(const Surface& s, const Vector3d& from, const Vector3d& n, std::uint32_t own) {
  std::uint32_t best = TriangleTree::kNoTriangle;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < s.triangles.size(); ++i) {
    if (i == own) continue;
    const auto& o = s.triangles[i];
    const Vector3d &a = s.x[o[0]], &b = s.x[o[1]], &c = s.x[o[2]], face = (b - a).cross(c - a);
    const double down = face.dot(n);
    if (!(down > 0.05 * face.norm() * n.norm())) continue;
    const double at = face.dot(a - from) / down;
    if (!(at > 1e-6) || at >= least) continue;
    const Vector3d p = from + at * n;
    const double most = -1e-3 * face.squaredNorm();
    if (face.dot((b - p).cross(c - p)) < most || face.dot((c - p).cross(a - p)) < most ||
        face.dot((a - p).cross(b - p)) < most)
      continue;
    least = at, best = i;
  }
  return best;
}

std::uint32_t eachNear(const Surface& s, const Vector3d& p, const Vector3d& normal) {
  std::uint32_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < s.triangles.size(); ++i) {
    const auto& t = s.triangles[i];
    const Vector3d centre = centreOf(s, t);
    double radius = 0;
    for (const auto k : t) radius = std::max(radius, (s.x[k] - centre).norm());
    if ((centre - p).norm() - radius >= least || normalOf(s, t).dot(normal) < 0.0) continue;
    const double distance = contact::nearest(p, {s.x[t[0]], s.x[t[1]], s.x[t[2]]}).distance;
    if (distance < least) least = distance, best = i;
  }
  return best;
}

}  // namespace

TEST(TriangleTree, FindsWhatALookAtEachTriangleFinds) {
  for (const double noise : {0.0, 0.2, 3.0}) {
    const Surface s = block(9, noise);
    const TriangleTree tree(s.x, s.triangles);
    for (std::uint32_t i = 0; i < s.triangles.size(); ++i) {
      const Vector3d centre = centreOf(s, s.triangles[i]), normal = normalOf(s, s.triangles[i]);
      ASSERT_EQ(tree.firstBehind(centre, -normal, i), eachBehind(s, centre, -normal, i)) << noise << " " << i;
      // From a corner and from within, where several are equally near.
      for (const Vector3d& p :
           {centre, s.x[s.triangles[i][0]], Vector3d(0.5 * centre + Vector3d(0.25, 0.25, 0.25))})
        ASSERT_EQ(tree.nearest(p, normal), eachNear(s, p, normal)) << noise << " " << i;
    }
  }
}

TEST(TriangleTree, OfNothingIsNothing) {
  const Surface none;
  const TriangleTree tree(none.x, none.triangles);
  EXPECT_EQ(tree.firstBehind({0, 0, 0}, {0, 0, 1}, 0), TriangleTree::kNoTriangle);
  EXPECT_EQ(tree.nearest({0, 0, 0}, {0, 0, 1}), 0u);
}

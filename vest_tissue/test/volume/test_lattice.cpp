// Lattices of tetrahedra in images and closed surfaces, and skins that hang in them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Geometry>

#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/volume/lattice.h"

namespace {

using namespace vest::volume;
using Eigen::Vector3d;

/// A ball of label 1 with a core of label 2, in voxels of 1 × 1 × 2 mm, turned and moved.
LabelledImage ball(double radius, double core) {
  LabelledImage image;
  image.size = {40, 40, 20};
  image.spacing = Vector3d(0.001, 0.001, 0.002);
  image.direction = Eigen::AngleAxisd(0.5, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  image.origin = Vector3d(0.1, -0.2, 0.3);
  for (std::uint32_t k = 0; k < 20; ++k)
    for (std::uint32_t j = 0; j < 40; ++j)
      for (std::uint32_t i = 0; i < 40; ++i) {
        const double r = Vector3d(0.001 * i - 0.0195, 0.001 * j - 0.0195, 0.002 * k - 0.019).norm();
        image.labels.push_back(r < core ? 2 : r < radius ? 1 : 0);
      }
  return image;
}
const Vector3d kMiddle(0.0195, 0.0195, 0.019);  // of the ball, in the image's axes

double volumeOf(const Lattice& l, std::size_t e) {
  const auto& t = l.tetrahedra[e];
  return (l.nodes[t[1]] - l.nodes[t[0]])
             .dot((l.nodes[t[2]] - l.nodes[t[0]]).cross(l.nodes[t[3]] - l.nodes[t[0]])) /
         6;
}

void expectSound(const Lattice& l) {
  for (std::size_t e = 0; e < l.tetrahedra.size(); ++e) ASSERT_GT(volumeOf(l, e), 0.0) << e;
  // The boundary closes: each of its edges is there as often one way as the other. A lattice whose cubes do
  // not fit has faces on both sides of the misfit, which close too: the count of faces shows them.
  std::map<std::pair<Index, Index>, int> edges;
  for (const auto& f : vest::scene::boundaryFaces(l.tetrahedra))
    for (std::size_t e = 0; e < 3; ++e) ++edges[{f[e], f[(e + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    ASSERT_NE(back, edges.end());
    ASSERT_EQ(back->second, count);
  }
}

Surface sphere(double radius, const Vector3d& centre, int n = 24) {
  Surface s;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i < 2 * n; ++i) {
      const double theta = M_PI * j / n, phi = M_PI * i / n;
      s.vertices.push_back(centre + radius * Vector3d(std::sin(theta) * std::cos(phi),
                                                      std::sin(theta) * std::sin(phi), std::cos(theta)));
    }
  const auto at = [&](int j, int i) {
    if (j == 0 || j == n) i = 0;
    return static_cast<Index>(j * 2 * n + i % (2 * n));
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < 2 * n; ++i) {
      if (j > 0) s.triangles.push_back({at(j, i), at(j + 1, i), at(j, i + 1)});
      if (j + 1 < n) s.triangles.push_back({at(j, i + 1), at(j + 1, i), at(j + 1, i + 1)});
    }
  return s;
}

TEST(Lattice, FillsAnImageWithItsVolumeLabelsAndPlace) {
  const LabelledImage image = ball(0.017, 0.008);
  const Lattice l = fillImage(image, 0.002);
  expectSound(l);
  double all = 0.0, core = 0.0;
  Vector3d centre = Vector3d::Zero();
  for (std::size_t e = 0; e < l.tetrahedra.size(); ++e) {
    const double v = volumeOf(l, e);
    all += v;
    if (l.label[e] == 2) core += v;
    for (const Index n : l.tetrahedra[e]) centre += 0.25 * v * l.nodes[n];
  }
  const double ball_volume = 4.0 / 3.0 * M_PI * std::pow(0.017, 3),
               core_volume = 4.0 / 3.0 * M_PI * std::pow(0.008, 3);
  EXPECT_NEAR(all, ball_volume, 0.03 * ball_volume);
  EXPECT_NEAR(core, core_volume, 0.12 * core_volume);
  EXPECT_LT((centre / all - (image.origin + image.direction * kMiddle)).norm(), 2e-4);
  // Faces of one cube meet whole faces of the next: no more boundary than the staircase of a ball has.
  EXPECT_LT(vest::scene::boundaryFaces(l.tetrahedra).size(), 6500u);
}

TEST(Lattice, FillsAClosedSurfaceAndRefusesOneWithAHole) {
  Surface s = sphere(0.02, Vector3d(0.01, 0.02, 0.03));
  Lattice l = fillSurface(s, 0.0025);
  expectSound(l);
  const double exact = 4.0 / 3.0 * M_PI * std::pow(0.02, 3);
  const auto total = [&] {
    double sum = 0.0;
    for (std::size_t e = 0; e < l.tetrahedra.size(); ++e) sum += volumeOf(l, e);
    return sum;
  };
  EXPECT_NEAR(total(), exact, 0.04 * exact);
  // Fitted to the surface its boundary lies on it.
  fitBoundary(l, s, 0.0025);
  expectSound(l);
  EXPECT_NEAR(total(), exact, 0.06 * exact);
  std::vector<double> off;
  for (const auto& f : vest::scene::boundaryFaces(l.tetrahedra))
    for (const Index n : f) off.push_back(std::fabs((l.nodes[n] - Vector3d(0.01, 0.02, 0.03)).norm() - 0.02));
  std::sort(off.begin(), off.end());
  EXPECT_LT(off[off.size() / 2], 2e-4);
  // Two that overlap make one body.
  Surface two = s;
  const Surface other = sphere(0.02, Vector3d(0.025, 0.02, 0.03));
  for (const auto& t : other.triangles) {
    const Index n = static_cast<Index>(s.vertices.size());
    two.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  }
  two.vertices.insert(two.vertices.end(), other.vertices.begin(), other.vertices.end());
  l = fillSurface(two, 0.0025);
  EXPECT_GT(total(), 1.4 * exact);
  EXPECT_LT(total(), 1.8 * exact);
  s.triangles.pop_back();
  EXPECT_THROW(fillSurface(s, 0.0025), std::invalid_argument);
  s = sphere(0.02, Vector3d::Zero());
  EXPECT_THROW(fillSurface(s, 1e-5), std::invalid_argument) << "too many cubes";
  for (auto& t : s.triangles) std::swap(t[0], t[1]);
  EXPECT_THROW(fillSurface(s, 0.0025), std::invalid_argument) << "inside out";
}

std::string refusal(const Surface& s, double cell, bool fit = false) {
  try {
    Lattice l = fillSurface(s, cell);
    if (fit) fitBoundary(l, s, cell);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

/// A tetrahedron of edge 1 at a corner, counter-clockwise from outside.
void addCorner(Surface& s, const Vector3d& at, const Vector3d& ahead, std::array<Index, 4> use) {
  const std::array<Vector3d, 4> x{at, at + Vector3d(ahead.x(), 0, 0), at + Vector3d(0, ahead.y(), 0),
                                  at + Vector3d(0, 0, ahead.z())};
  for (std::size_t i = 0; i < 4; ++i) {
    if (use[i] != ~0u) continue;
    use[i] = static_cast<Index>(s.vertices.size());
    s.vertices.push_back(x[i]);
  }
  const bool turned = ahead.prod() < 0;
  for (auto t : {std::array<Index, 3>{use[0], use[2], use[1]},
                 {use[0], use[1], use[3]},
                 {use[1], use[2], use[3]},
                 {use[2], use[0], use[3]}}) {
    if (turned) std::swap(t[0], t[1]);
    s.triangles.push_back(t);
  }
}

TEST(Lattice, APinchedSurfaceIsRefusedAndSaysWhere) {
  constexpr Index kNew = ~0u;
  Surface one;
  addCorner(one, Vector3d::Zero(), Vector3d(1, 1, 1), {kNew, kNew, kNew, kNew});
  EXPECT_EQ(refusal(one, 0.1), "");
  Surface vertex = one;  // a second one hangs on its corner alone
  addCorner(vertex, Vector3d::Zero(), Vector3d(-1, -1, -1), {0, kNew, kNew, kNew});
  EXPECT_NE(refusal(vertex, 0.1).find("pinched: it meets itself at the vertex (0, 0, 0)"), std::string::npos)
      << refusal(vertex, 0.1);
  Surface edge = one;  // or along its edge
  addCorner(edge, Vector3d::Zero(), Vector3d(1, -1, -1), {0, 1, kNew, kNew});
  EXPECT_NE(refusal(edge, 0.1).find("pinched: 4 triangles meet at the edge from (0, 0, 0) to (1, 0, 0)"),
            std::string::npos)
      << refusal(edge, 0.1);
}

TEST(Lattice, ASurfaceMuchLargerThanTheMeshIsRefusedWithBothSizes) {
  Lattice l = fillSurface(sphere(0.02, Vector3d::Zero()), 0.005);
  for (const double scale : {1e3, 1e5, 1e30}) {
    Surface s = sphere(0.02 * scale, Vector3d::Zero());
    try {
      fitBoundary(l, s, 0.005);
      ADD_FAILURE() << scale;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("of the size ("), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("far from the mesh, which has the size (0.04"),
                std::string::npos)
          << error.what();
    }
    EXPECT_THROW(embed(l, s), std::invalid_argument) << scale;
  }
  // Large triangles through the whole mesh are looked at where they pass, and no more.
  Surface one;
  addCorner(one, Vector3d::Zero(), Vector3d(1, 1, 1), {~0u, ~0u, ~0u, ~0u});
  EXPECT_EQ(refusal(one, 0.018, true), "");
}

TEST(Skin, EmbeddedVerticesLieWhereTheyWereAndFollowEveryLinearMotion) {
  const LabelledImage image = ball(0.017, 0.0);
  Lattice l = fillImage(image, 0.004);
  const Surface s = surfaceOf(image, 0.002);
  ASSERT_GT(s.triangles.size(), 500u);
  double enclosed = 0.0;
  for (const auto& t : s.triangles)
    enclosed += s.vertices[t[0]].dot(s.vertices[t[1]].cross(s.vertices[t[2]])) / 6;
  const double exact = 4.0 / 3.0 * M_PI * std::pow(0.017, 3);
  EXPECT_NEAR(enclosed, exact, 0.1 * exact) << "closed, counter-clockwise from outside";
  const auto skin = embed(l, s);
  ASSERT_EQ(skin.binding_start.size(), s.vertices.size() + 1);
  Eigen::Matrix3d A;
  A << 1.1, 0.2, 0.0, -0.1, 0.9, 0.3, 0.0, 0.1, 1.2;
  for (std::size_t v = 0; v < s.vertices.size(); ++v) {
    Vector3d place = Vector3d::Zero(), moved = place;
    float sum = 0.0f;
    ASSERT_EQ(skin.binding_start[v + 1] - skin.binding_start[v], 4u);
    for (std::uint32_t e = skin.binding_start[v]; e < skin.binding_start[v + 1]; ++e) {
      const double w = skin.binding_weights[e];
      place += w * l.nodes[skin.binding_knots[e]];
      moved += w * (A * l.nodes[skin.binding_knots[e]]);
      sum += skin.binding_weights[e];
      EXPECT_LT(std::fabs(w), 2.5) << "no wild extrapolation";
    }
    EXPECT_NEAR(sum, 1.0f, 1e-5f);
    EXPECT_LT((place - s.vertices[v]).norm(), 1e-6);
    EXPECT_LT((moved - A * s.vertices[v]).norm(), 1e-6);
  }
}

}  // namespace

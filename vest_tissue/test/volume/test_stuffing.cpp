// Labels become tetrahedra that fit each other, have bounded angles, and lie where the image says.
#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "vest_tissue/volume/stuffing.h"

namespace {

using namespace vest::volume;
using Eigen::Vector3d;

constexpr double kVoxel = 0.0015, kCell = 0.005, kRadius = 0.014;
const Vector3d kBox(0.030, 0.025, 0.020), kMiddle(0.004, -0.002, 0.001);

/// A box of label 1 around a sphere of label 2; its axes are turned in the world.
LabelledImage boxWithSphere() {
  LabelledImage image;
  image.size = {52, 46, 38};
  image.spacing.setConstant(kVoxel);
  image.direction = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3d corner = -0.5 * kVoxel * Vector3d(51, 45, 37);
  image.origin = image.direction * corner;
  for (std::uint32_t k = 0; k < 38; ++k)
    for (std::uint32_t j = 0; j < 46; ++j)
      for (std::uint32_t i = 0; i < 52; ++i) {
        const Vector3d place = corner + kVoxel * Vector3d(i, j, k);
        const bool box = (place.cwiseAbs().array() <= kBox.array()).all();
        image.labels.push_back((place - kMiddle).norm() <= kRadius ? 2 : box ? 1 : 0);
      }
  return image;
}

const LabelledImage& image() {
  static const LabelledImage one = boxWithSphere();
  return one;
}

/// Faces with the tetrahedra at them.
std::map<std::array<Index, 3>, std::vector<std::size_t>> facesOf(const Lattice& lattice) {
  std::map<std::array<Index, 3>, std::vector<std::size_t>> faces;
  for (std::size_t t = 0; t < lattice.tetrahedra.size(); ++t)
    for (int i = 0; i < 4; ++i) {
      const auto& n = lattice.tetrahedra[t];
      std::array<Index, 3> face{n[(i + 1) % 4], n[(i + 2) % 4], n[(i + 3) % 4]};
      std::sort(face.begin(), face.end());
      faces[face].push_back(t);
    }
  return faces;
}

TEST(Stuffing, VolumesAreThoseOfTheShapesWithinThreePercent) {
  const Lattice lattice = stuffLabels(image(), kCell);
  const double sphere = 4.0 / 3 * M_PI * std::pow(kRadius, 3), box = 8 * kBox.prod() - sphere;
  EXPECT_NEAR(volumeOf(lattice, 2) / sphere, 1, 0.03);
  EXPECT_NEAR(volumeOf(lattice, 1) / box, 1, 0.03);
}

TEST(Stuffing, AnglesAreBoundedAndNothingIsInverted) {
  for (const double cell : {0.0035, kCell, 0.008}) {
    const auto [least, greatest] = dihedralAngles(stuffLabels(image(), cell));
    EXPECT_GE(least, 10.7) << cell;
    EXPECT_LE(greatest, 165.0001) << cell;
  }
}

TEST(Stuffing, FacesFitAndSurfacesLieWithinAVoxel) {
  const Lattice lattice = stuffLabels(image(), kCell);
  std::size_t outer = 0, inner = 0;
  for (const auto& [face, at] : facesOf(lattice)) {
    ASSERT_LE(at.size(), 2u);
    for (const Index n : face) {
      const Vector3d place = image().direction.transpose() * lattice.nodes[n];
      if (at.size() == 1) {
        ++outer;
        const double beyond = (place.cwiseAbs() - kBox).maxCoeff();
        EXPECT_LT(std::abs(beyond), kVoxel) << place.transpose();
      } else if (lattice.label[at[0]] != lattice.label[at[1]]) {
        ++inner;
        EXPECT_LT(std::abs((place - kMiddle).norm() - kRadius), kVoxel) << place.transpose();
      }
    }
  }
  EXPECT_GT(outer, 1000u);
  EXPECT_GT(inner, 300u);
}

TEST(Stuffing, TheSameImageGivesTheSameBits) {
  const Lattice a = stuffLabels(image(), kCell), b = stuffLabels(image(), kCell);
  EXPECT_EQ(a.tetrahedra, b.tetrahedra);
  EXPECT_EQ(a.label, b.label);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  EXPECT_TRUE(std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin()));
}

TEST(Stuffing, RefusesWhatGivesNoMesh) {
  LabelledImage empty = image();
  std::fill(empty.labels.begin(), empty.labels.end(), std::uint16_t{0});
  EXPECT_THROW(stuffLabels(empty, kCell), std::invalid_argument);
  for (const double cell : {0.0, -1.0, 1e-9, std::nan("")})
    EXPECT_THROW(stuffLabels(image(), cell), std::invalid_argument) << cell;
}

}  // namespace

#include "surface_distance.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <nanoflann.hpp>

#include "vest_tissue/modelling/bake.h"

namespace vest::tools {
namespace {

struct Cloud {
  const std::vector<Eigen::Vector3d>& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t k) const { return points[i][static_cast<Eigen::Index>(k)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, std::uint32_t>;

constexpr std::size_t kFine = 40000, kCoarse = 1500;

}  // namespace

std::vector<Eigen::Vector3d> sampleEvenly(const Surface& surface, std::size_t about) {
  double area = 0;
  const auto areaOf = [&](const std::array<std::uint32_t, 3>& t) {
    return 0.5 * (surface.points[t[1]] - surface.points[t[0]])
                     .cross(surface.points[t[2]] - surface.points[t[0]])
                     .norm();
  };
  for (const auto& t : surface.triangles) area += areaOf(t);
  const double each = area / static_cast<double>(about);
  std::vector<Eigen::Vector3d> samples;
  double due = 0.5;
  std::size_t index = 0;
  for (const auto& t : surface.triangles) {
    for (due += areaOf(t) / each; due >= 1; due -= 1) {
      // Additive recurrence of the plastic number fills the triangle evenly, without chance.
      ++index;
      double u = std::fmod(0.7548776662466927 * static_cast<double>(index), 1.0);
      double v = std::fmod(0.5698402909980532 * static_cast<double>(index), 1.0);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      samples.push_back((1 - u - v) * surface.points[t[0]] + u * surface.points[t[1]] +
                        v * surface.points[t[2]]);
    }
  }
  return samples;
}

double meanDistance(const Surface& from, const Surface& to) {
  // The other surface as a dense cloud; its spacing (about 0.3 mm on these organs) bounds the error.
  const auto samples = sampleEvenly(from, 4000), dense = sampleEvenly(to, kFine);
  const Cloud cloud{dense};
  Tree tree(3, cloud);
  tree.buildIndex();
  double sum = 0;
  for (const auto& p : samples) {
    std::uint32_t index = 0;
    double squared = 0;
    tree.knnSearch(p.data(), 1, &index, &squared);
    sum += std::sqrt(squared);
  }
  return sum / static_cast<double>(samples.size());
}

Eigen::Isometry3d rigidFit(const Surface& moving, const Surface& still) {
  const auto start = sampleEvenly(moving, kCoarse), target = sampleEvenly(still, kCoarse),
             dense = sampleEvenly(still, kFine);
  const Cloud still_cloud{dense};
  Tree still_tree(3, still_cloud);
  still_tree.buildIndex();
  Eigen::Vector3d centre_moving = Eigen::Vector3d::Zero(), centre_still = Eigen::Vector3d::Zero();
  for (const auto& p : start) centre_moving += p / static_cast<double>(start.size());
  for (const auto& p : target) centre_still += p / static_cast<double>(target.size());
  Eigen::Isometry3d fit = Eigen::Isometry3d::Identity();
  fit.translation() = centre_still - centre_moving;
  for (int round = 0; round < 60; ++round) {
    std::vector<Eigen::Vector3d> moved;
    for (const auto& p : start) moved.push_back(fit * p);
    const Cloud moved_cloud{moved};
    Tree moved_tree(3, moved_cloud);
    moved_tree.buildIndex();
    Eigen::Matrix3Xd a(3, static_cast<Eigen::Index>(start.size() + target.size())), b = a;
    Eigen::Index n = 0;
    for (std::size_t i = 0; i < start.size(); ++i, ++n) {
      std::uint32_t index = 0;
      double squared = 0;
      still_tree.knnSearch(moved[i].data(), 1, &index, &squared);
      a.col(n) = start[i];
      b.col(n) = dense[index];
    }
    for (const auto& p : target) {
      std::uint32_t index = 0;
      double squared = 0;
      moved_tree.knnSearch(p.data(), 1, &index, &squared);
      a.col(n) = start[index];
      b.col(n++) = p;
    }
    fit.matrix() = Eigen::umeyama(a, b, false);
  }
  return fit;
}

std::string defaultScene() {
  const std::string file = "/gynaecology/gynaecology.yaml";
  const std::string source = VEST_TISSUE_SOURCE_DATA "/../scenes" + file;
  return std::ifstream(source).good() ? source : VEST_TISSUE_INSTALLED_DATA "/../scenes" + file;
}

}  // namespace vest::tools

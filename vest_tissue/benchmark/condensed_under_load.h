#pragma once

#include <chrono>

#include "slab.h"
#include "vest_tissue/cache/block.h"
#include "vest_tissue/fem/tissue.h"

namespace vest::bench {

/// A condensed object of 101,400 elements, 60 × 40 × 40 mm, its underside held, in steps of 1 ms as a World
/// takes them. What it prepares is kept where sessions keep theirs.
class CondensedUnderLoad {
 public:
  CondensedUnderLoad() : object_(object()) {
    const auto begin = std::chrono::steady_clock::now();
    model_ = fem::makeTissue(*object_.fem, object_.fem->motion, cache::defaultDirectory());
    fem::prepareTissue(*model_, kStep);
    seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    state_ = fem::tissueAtRest(*model_, object_.position);
    scratch_ = fem::TissueScratch(*model_, state_.x.size());
    for (auto& row : held_) row.assign(state_.x.size(), 0.0f);
  }
  std::size_t elements() const { return object_.fem->tetrahedra.size(); }
  std::size_t nodes() const { return model_->compliance.nodes(); }
  double megabytes() const { return 1e-6 * static_cast<double>(model_->compliance.bytes()); }
  double seconds() const { return seconds_; }  ///< of preparing it, or of reading what was prepared

  /// Ten knots on top are held 2 mm above their places.
  void hold() {
    scratch_.points.clear();
    for (fem::Index n = 0; n < state_.x.size() && scratch_.points.size() < 10; ++n) {
      if (!atTop(object_.position[n], 0.006)) continue;
      fem::TissuePoint point;
      point.kind = 1;
      point.knots = {n, n, n}, point.weights = {1, 0, 0};
      point.target = object_.position[n] + Eigen::Vector3d(0, 0, 0.002);
      point.stiffness = 500.0;
      scratch_.points.push_back(point);
    }
  }
  /// A ball of 5 mm presses its top by 2 mm: a contact in the middle of each triangle under it.
  void press() {
    scratch_.points.clear();
    constexpr double kRadius = 0.005, kDeep = 0.002;
    const Eigen::Vector3d centre(0.03, 0.02, 0.04 + kRadius - kDeep);
    for (const auto& t : object_.contact_triangles) {
      const Eigen::Vector3d middle =
          (object_.position[t[0]] + object_.position[t[1]] + object_.position[t[2]]) / 3;
      if (!atTop(middle, 1.0) || (middle - centre).norm() > kRadius) continue;
      fem::TissuePoint point;
      std::copy(t.begin(), t.end(), point.knots.begin());
      point.weights = {1.0 / 3, 1.0 / 3, 1.0 / 3};
      point.normal = Eigen::Vector3d::UnitZ();
      point.target = centre, point.reach = kRadius;
      point.stiffness = 2000.0, point.most_stiffness = 5000.0, point.friction = 0.1;
      scratch_.points.push_back(point);
    }
  }
  std::size_t points() const { return scratch_.points.size(); }
  void step() {
    const std::array<const float*, 3> held{held_[0].data(), held_[1].data(), held_[2].data()};
    if (!fem::freeTissueStep(*model_, state_, kStep, held, Eigen::Vector3d(0, 0, -9.81), scratch_))
      throw std::runtime_error("the tissue refused a step");
    fem::solveTissuePoints(*model_, state_, kStep, scratch_);
    if (!fem::endTissueStep(*model_, state_, kStep, scratch_))
      throw std::runtime_error("the tissue refused a step");
  }
  /// m, the furthest that a knot is from where it was at rest.
  double moved() const {
    double most = 0.0;
    for (std::size_t n = 0; n < state_.x.size(); ++n)
      most = std::max(most, (state_.x[n] - object_.position[n]).norm());
    return most;
  }

 private:
  static constexpr double kStep = 0.001;  // s
  static bool atTop(const Eigen::Vector3d& p, double within) {
    return p.z() > 0.0399 && std::fabs(p.x() - 0.03) < within && std::fabs(p.y() - 0.02) < within;
  }
  static scene::Object object() {
    fem::Description d = fem::specimen::makeBox({26, 26, 25, 0.06, 0.04, 0.04}, false);
    d.motion = fem::Motion::Condensed;
    d.material = {8e3, 0.4, 1050.0, 1.0, 0.002};
    for (fem::Index n = 0; n < d.nodes.size(); ++n)
      if (d.nodes[n].z() == 0.0) d.fixed.push_back(n);
    return fem::specimen::object(d);
  }
  scene::Object object_;
  std::shared_ptr<fem::TissueModel> model_;
  fem::TissueState state_;
  fem::TissueScratch scratch_;
  std::vector<float> held_[3];
  double seconds_ = 0.0;
};

}  // namespace vest::bench

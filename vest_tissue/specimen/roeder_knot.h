#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "../src/suture/elements.h"
#include "crossings.h"
#include "laid_knots.h"
#include "vest_tissue/suture/knot_kind.h"
#include "vest_tissue/suture/roeder.h"

namespace vest::suture::specimen {

/// Polyglactin 910, 0, as data/sutures.yaml has it. @param friction slack, on itself
inline Section polyglactin(double friction = 0.2) {
  Section s = solidSection(0.00018725, 1125, 6e9, 0.4);
  s.bend *= 0.05, s.twist *= 0.05;
  s.friction = friction, s.friction_fall = 0.2 * friction, s.friction_pressure = 1e7;
  s.strain_damping = 1e-4, s.drag = 1e-4;
  return s;
}

/// A loop of `length` with a Roeder knot, loosely as print teaches to tie it
/// (laparoscopyhospital.com/v33.htm): the short limb goes over the standing part, behind it and out between
/// both limbs; three times round both; round the standing part once more, out between the limbs, and under
/// its own turn. Strands lie 1.25 diameters apart. Frame as of roederLoop().
inline std::vector<Eigen::Vector3d> looseRoeder(double diameter, double length, double spacing) {
  using Eigen::Vector3d;
  // In units of that distance: the standing part is the z axis, the other limb comes at x = 2, front is -y.
  static constexpr double kEnd[][3] = {
      {2, 0, 9},         {2, 0, 7},          {2, 0, 5},          {2, 0, 3},        {2, 0, 1.2},
      {1.8, -0.35, 0.6}, {1.1, -0.95, 0.25}, {0, -1.05, 0.2},    {-1.05, 0, 0.5},  {0, 1.05, 0.8},
      {0.75, 0.65, 1.1}, {1, 0, 1.4},        {0.75, -0.65, 1.7}, {0, -1.05, 1.95}, {-1.05, 0, 2.3},
      {0, 1.1, 2.6},     {1, 1.2, 2.75},     {2, 1.1, 2.9},      {3.05, 0, 3.2},   {2, -1.1, 3.4},
      {1, -1.2, 3.5},    {0, -1.1, 3.6},     {-1.05, 0, 3.8},    {0, 1.1, 4.0},    {1, 1.2, 4.1},
      {2, 1.1, 4.2},     {3.05, 0, 4.4},     {2, -1.1, 4.55},    {1, -1.2, 4.65},  {0, -1.1, 4.75},
      {-1.05, 0, 4.95},  {0, 1.1, 5.15},     {1, 1.2, 5.3},      {2, 1.1, 5.5},    {3.05, 0, 6.2},
      {2, -1.25, 6.7},   {1, -1.55, 6.8},    {0, -1.2, 6.9},     {-1.05, 0, 7.1},  {0, 1.05, 7.4},
      {0.75, 0.65, 7.7}, {1, -0.15, 7.8},    {1, -0.45, 7.3},    {1, -0.45, 6.7},  {1, -0.6, 6.1},
      {1, -1.2, 5.7},    {1, -2.2, 5.6},     {1, -4, 5.6},       {1, -6, 5.6},     {1, -9, 5.6},
      {1, -12, 5.6}};
  const double unit = 1.25 * diameter, radius = length / (2.0 * kPi), neck = 9.0 * unit;
  std::vector<Vector3d> p;
  for (double z = -0.02; z < neck + 0.5 * unit; z += unit) p.push_back({0, 0, z});
  constexpr int kRound = 24;
  for (int k = 0; k <= kRound; ++k) {
    const double angle = kPi * (1.25 - 1.5 * k / kRound);  // open at the neck
    p.push_back(Vector3d(unit + radius * std::cos(angle), 0, neck + 1.1 * radius + radius * std::sin(angle)));
  }
  for (const auto& x : kEnd) p.push_back(unit * Vector3d(x[0], x[1], x[2]));
  p.push_back(p.back() - Vector3d(0, unit, 0));
  // A curve through them (centripetal Catmull–Rom; Barry and Goldman 1988).
  std::vector<Vector3d> path;
  for (std::size_t i = 1; i + 2 < p.size(); ++i) {
    double t[4] = {};
    for (std::size_t k = 1; k < 4; ++k) t[k] = t[k - 1] + std::sqrt((p[i - 1 + k] - p[i - 2 + k]).norm());
    constexpr int kSteps = 24;
    for (int n = 0; n < kSteps; ++n) {
      const double at = t[1] + (t[2] - t[1]) * n / kSteps;
      const auto between = [&](const Vector3d& a, const Vector3d& b, int from, int to) {
        return Vector3d(((t[to] - at) * a + (at - t[from]) * b) / (t[to] - t[from]));
      };
      const Vector3d a = between(p[i - 1], p[i], 0, 1), b = between(p[i], p[i + 1], 1, 2),
                     c = between(p[i + 1], p[i + 2], 2, 3);
      path.push_back(between(between(a, b, 0, 2), between(b, c, 1, 3), 1, 2));
    }
  }
  return evenly(path, spacing);
}

/// A loop in its pusher, by the rod alone: the pusher comes along z and follows the knot with `push`; a hand
/// draws the rear end; a firm post stands in the loop.
class LoopRoom : public Moving {
 public:
  double push = 2.0;   ///< N, of the pusher on the knot
  double post = 0.0;   ///< m, radius; 0: none
  double hand = 0.0;   ///< N, pull at the rear end
  double press = 0.0;  ///< N, of the point on the knot
  int through = 0;     ///< how often segments went through each other
  bool well = true;

  /// @param damping 1/s, of what it lies in
  LoopRoom(const std::vector<Eigen::Vector3d>& nodes, const Section& section, double damping)
      : Moving(rod(nodes, section, damping)),
        rear_(nodes[0]),
        shear_(state.position.size(), Eigen::Vector3d::Zero()) {
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (nodes[i].z() > nodes[far_].z()) far_ = i;
    middle_ = Eigen::Vector3d(0.0005, 0, nodes[far_].z() - 0.0045);
  }

  /// One step; the hand moves by `way` (m).
  void go(double way) {
    drawn_ += way;
    if (post > 0.0 && pushes_) point_ += kStep * std::clamp(0.05 * (push - press) / push, -0.02, 0.05);
    gather();
    const std::vector<Eigen::Vector3d> was = state.position;
    well = step(model, state, scratch, kStep) == StepStatus::Ok && well;
    through += std::abs(crossings(was, state.position));
    hand = press = 0.0;
    for (std::size_t k = 0; k < scratch.supports.size(); ++k) {
      const Support& a = scratch.supports[k];
      if (k >= on_post_) shear_[touched_[k - on_post_]] = a.shear;
      if (k >= on_point_ && k < on_post_) press += a.force.z();
      if (a.bond == Bond::Hold) hand = a.force.norm();
    }
  }
  /// Draws until the hand bears the force, or by the way.
  void draw(double force, double way) {
    for (double at = 0.0; at < way && hand < force; at += kSpeed * kStep) go(kSpeed * kStep);
  }
  /// The short end is drawn aside; then the thread keeps the shape that it has.
  void set(double force) {
    constexpr int kSteps = 1000;
    const double held = hand;
    for (int k = 0; k < kSteps; ++k) {
      model.force.back() = Eigen::Vector3d(0, -force * std::min(1.0, 2.5 * k / kSteps), 0);
      go(hand < held ? kSpeed * kStep : hand > 1.05 * held ? -kSpeed * kStep : 0.0);
    }
    model.force.back().setZero();
    const std::vector<Eigen::Quaterniond> none;
    for (Index k = model.strands[0].joints_begin; k < model.strands[0].joints_end; ++k)
      if (model.joints[k].a >= far_)
        state.natural_curvature[k].head<2>() =
            bendOf(model, state, none, k).head<2>() / model.joints[k].length;
    relieve();
  }
  /// The hand gives way.
  void relieve() {
    while (hand > 0.02) go(-kSpeed * kStep);
  }
  /// And the pusher goes, the thread is cut.
  void leave() {
    relieve();
    pushes_ = false;
    state.severed[std::max<std::size_t>(4, inside_ - 6)] = 1;
    for (int k = 0; k < 200; ++k) go(0.0);
  }
  /// N: the greatest tension of the loop as the post grows by `more` (m).
  double swell(double more) {
    double most = 0.0;
    for (double at = 0.0; at < more; at += kGrowth * kStep) {
      post += kGrowth * kStep;
      go(0.0);
      std::size_t top = 0;
      for (std::size_t i = 0; i + 1 < state.position.size(); ++i)
        if (state.position[i].z() > state.position[top].z()) top = i;
      most = std::max(most, tensionOf(model, state, model.strands[0], static_cast<Index>(top)));
    }
    return most;
  }
  KnotKind kind() const {
    KnotScratch w(state.position.size());
    return kindOf(state.position.data(), state.position.size(), w);
  }
  double point() const { return point_; }  ///< m, along z

  static constexpr double kStep = 0.0005;  // s

 private:
  static constexpr double kSpeed = 0.04, kGrowth = 0.002;                  // m/s
  static constexpr double kBore = 2000.0, kFace = 1000.0, kFirm = 2000.0;  // N/m

  static RodDescription rod(const std::vector<Eigen::Vector3d>& nodes, const Section& section,
                            double damping) {
    RodDescription rod;
    rod.name = "loop", rod.nodes = nodes, rod.section = section;
    rod.section.damping = damping;
    rod.natural_shape = true;
    return rod;
  }
  Support at(std::size_t node) const {
    Support a;
    const bool last = node + 1 == state.position.size();
    a.segment = static_cast<Index>(last ? node - 1 : node), a.s = last ? 1.0 : 0.0;
    return a;
  }
  void gather() {
    const auto& x = state.position;
    auto& supports = scratch.supports;
    supports.clear(), touched_.clear();
    if (pushes_) {
      while (inside_ + 1 < x.size() && x[inside_].z() < point_) ++inside_;
      while (inside_ > 1 && x[inside_ - 1].z() > point_) --inside_;
      for (std::size_t i = 0; i < inside_; ++i) {
        Support a = at(i);
        a.bond = i > 0 ? Bond::Slide : Bond::Hold;
        a.from = a.to = i > 0 ? Eigen::Vector3d(0, 0, x[i].z()) : rear_ - Eigen::Vector3d(0, 0, drawn_);
        a.normal = Eigen::Vector3d::UnitZ();
        a.stiffness = kBore, a.friction = 0.05;
        supports.push_back(a);
      }
    }
    on_point_ = supports.size();
    for (std::size_t i = inside_ + 1; pushes_ && i < x.size(); ++i) {
      if (x[i].z() - point_ > 0.002 || x[i].head<2>().norm() > 0.0025) continue;
      Support a = at(i);
      a.from = a.to = Eigen::Vector3d(x[i].x(), x[i].y(), point_);
      a.normal = Eigen::Vector3d::UnitZ();
      a.reach = model.strands[0].section.radius;
      a.stiffness = kFace;
      supports.push_back(a);
    }
    on_post_ = supports.size();
    for (std::size_t i = 0; post > 0.0 && i < x.size(); ++i) {
      Eigen::Vector3d off = x[i] - middle_;
      off.y() = 0.0;
      if (off.norm() > post + 0.0015) continue;
      Support a = at(i);
      a.normal = off.normalized();
      a.from = a.to = x[i] - off;
      a.reach = post + model.strands[0].section.radius;
      a.stiffness = kFirm, a.friction = 0.2, a.shear = shear_[i];
      supports.push_back(a), touched_.push_back(i);
    }
  }

  Eigen::Vector3d rear_, middle_;
  std::size_t far_ = 0, inside_ = 1, on_point_ = 0, on_post_ = 0;
  double drawn_ = 0.0, point_ = -0.0002;
  bool pushes_ = true;
  std::vector<Eigen::Vector3d> shear_;
  std::vector<std::size_t> touched_;  ///< nodes that the post's supports hold
};

}  // namespace vest::suture::specimen

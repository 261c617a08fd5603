#include "vest_instruments/collision/collision.h"

#include <vector>

#include "fcl.h"
#include "vest_instruments/tools/tool_geometry.h"

namespace vest::collision {

/// A capsule in B and its box.
struct Placed {
  tools::Capsule capsule;
  Eigen::Vector3d low, high;
};

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using tools::Capsule;
using tools::kInstrumentCount;

Placed place(const Isometry3d& X, const Capsule& c) {
  Placed p{{X * c.a, X * c.b, c.radius}, {}, {}};
  p.low = p.capsule.a.cwiseMin(p.capsule.b).array() - c.radius;
  p.high = p.capsule.a.cwiseMax(p.capsule.b).array() + c.radius;
  return p;
}

/// FCL's capsule lies along its z with the origin in the middle.
Isometry3d capsulePose(const Capsule& c) {
  Isometry3d X = Isometry3d::Identity();
  X.translation() = 0.5 * (c.a + c.b);
  X.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), c.b - c.a).toRotationMatrix();
  return X;
}

bool apart(const Placed& a, const Placed& b) {
  return (a.low.array() > b.high.array()).any() || (b.low.array() > a.high.array()).any();
}

bool touch(const Placed& a, const Placed& b) {
  if (apart(a, b)) return false;
  const fcl::Capsuled ca(a.capsule.radius, (a.capsule.b - a.capsule.a).norm());
  const fcl::Capsuled cb(b.capsule.radius, (b.capsule.b - b.capsule.a).norm());
  // Capsules against each other: a distance query is exact in FCL 0.7 (segment to segment).
  fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
  return fcl::distance(&ca, fclPose(capsulePose(a.capsule)), &cb, fclPose(capsulePose(b.capsule)), request,
                       result) <= 0.0;
}

}  // namespace

struct CollisionModel::Implementation {
  struct Wall {
    fcl::Boxd shape;
    Isometry3d X;
    Vector3d low, high;
  };
  std::vector<Wall> walls;
  std::array<std::vector<Placed>, kInstrumentCount> parts;

  void addWall(const Vector3d& low, const Vector3d& high) {
    walls.push_back({fclBox(high - low), Isometry3d(Eigen::Translation3d(0.5 * (low + high))), low, high});
  }

  bool touchesBox(const Placed& p) const {
    for (const Wall& w : walls) {
      if ((p.low.array() > w.high.array()).any() || (w.low.array() > p.high.array()).any()) continue;
      const fcl::Capsuled c(p.capsule.radius, (p.capsule.b - p.capsule.a).norm());
      fcl::CollisionRequestd request;
      fcl::CollisionResultd result;
      if (fcl::collide(&c, fclPose(capsulePose(p.capsule)), &w.shape, fclPose(w.X), request, result) > 0)
        return true;
    }
    return false;
  }

  void build(std::vector<Placed>& out, const ArmPose& arm) const {
    out.clear();
    if (!arm.present) return;
    const tools::ToolGeometry& g = tools::toolGeometry(arm.tool);
    if (arm.insertion > g.jaw_length) {
      out.push_back(
          place(arm.X_BTip, {Vector3d(0, 0, -arm.insertion), Vector3d(0, 0, -g.jaw_length), g.shaft_radius}));
    }
    for (const Capsule& c : g.fixed) out.push_back(place(arm.X_BTip, c));
    for (std::size_t side = 0; side < 2; ++side) {
      const double angle = (side == 0 ? 0.5 : -0.5) * arm.jaw;
      const Isometry3d X = arm.X_BTip * Eigen::Translation3d(0, 0, -g.jaw_length) *
                           Eigen::AngleAxisd(angle, Vector3d::UnitY());
      for (const Capsule& c : g.jaw[side]) out.push_back(place(X, c));
    }
  }
};

CollisionModel::CollisionModel(const kinematics::TrainerBox& box)
    : implementation_(std::make_unique<Implementation>()) {
  const double x = 0.5 * box.inside.x(), y = 0.5 * box.inside.y(), z = box.inside.z() + box.dome;
  constexpr double t = 0.05;  // m: thick, so that no fast step passes through
  implementation_->addWall({-x - t, -y - t, -t}, {x + t, y + t, 0.0});
  implementation_->addWall({-x - t, -y - t, z}, {x + t, y + t, z + t});
  implementation_->addWall({-x - t, -y - t, 0.0}, {-x, y + t, z});
  implementation_->addWall({x, -y - t, 0.0}, {x + t, y + t, z});
  implementation_->addWall({-x, -y - t, 0.0}, {x, -y, z});
  implementation_->addWall({-x, y, 0.0}, {x, y + t, z});
  for (auto& parts : implementation_->parts) parts.reserve(16);
}

CollisionModel::~CollisionModel() = default;
CollisionModel::CollisionModel(CollisionModel&&) noexcept = default;
CollisionModel& CollisionModel::operator=(CollisionModel&&) noexcept = default;

std::array<bool, kInstrumentCount> CollisionModel::check(const std::array<ArmPose, kInstrumentCount>& arms) {
  std::array<bool, kInstrumentCount> colliding{};
  auto& parts = implementation_->parts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    implementation_->build(parts[i], arms[i]);
    for (const Placed& p : parts[i]) {
      if (implementation_->touchesBox(p)) {
        colliding[i] = true;
        break;
      }
    }
  }
  const auto meet = [&](std::size_t i, std::size_t k) {
    for (const Placed& a : parts[i]) {
      for (const Placed& b : parts[k]) {
        if (touch(a, b)) return true;
      }
    }
    return false;
  };
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t k = i + 1; k < parts.size(); ++k) {
      if (colliding[i] && colliding[k]) continue;
      if (meet(i, k)) colliding[i] = colliding[k] = true;
    }
  }
  return colliding;
}

}  // namespace vest::collision

#pragma once

// What bench_net and the table of figures share: the seed scene's net under the kernel, and the same net in
// Bullet.
#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "seed_net.h"
#include "vest_tissue/net/block.h"
#include "vest_tissue/net/link_kernel.h"

#if defined(VEST_HAVE_BULLET)
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#endif

namespace vest::bench {

using namespace net;

inline material::Law law() {
  material::Law l;
  l.youngs_modulus = 1;
  l.a2 = 1.0;
  l.a3 = 2.0;
  l.a4 = 5.0;
  return l;
}

/// One kernel step of all 21 objects: link forces with the fourth-order law, integration. One block of arrays
/// an object.
class Net {
 public:
  /// @param copies the same net so many times
  explicit Net(bool shuffled, int copies = 1) {
    for (int copy = 0; copy < copies; ++copy) add(shuffled);
  }
  std::size_t objects() const { return objects_.size(); }
  /// So many sub-steps of one object, which stays in the first cache level.
  void step(std::size_t object, KernelLevel level, int sub_steps = 1) {
    Object& o = *objects_[object];
    const KnotArrays knots = o.block.knotArrays();
    const MotionArrays m = o.block.motionArrays();
    Upcoming upcoming;  // as World::step does
    if (object + 1 < objects_.size()) {
      const Object& next = *objects_[object + 1];
      next.block.addMemory(upcoming);
      next.table.addMemory(upcoming);
    }
    for (int i = 0; i < sub_steps; ++i) {
      upcoming.ask(i);
      addLinkForces(o.table, knots, level);
      integrateKnots(m, 0.00005f, level);
    }
  }
  void step(KernelLevel level) {
    for (std::size_t i = 0; i < objects_.size(); ++i) step(i, level);
  }
  std::size_t links() const { return links_; }

 private:
  void add(bool shuffled) {
    for (auto& tube : vest::specimen::makeSeedNet(0.5f, 0.001f)) {
      const std::size_t n = tube.x.size() - 2 * kLanes;
      auto links = tube.links;
      std::vector<std::uint32_t> map(n);
      for (std::size_t i = 0; i < n; ++i) map[i] = static_cast<std::uint32_t>(i);
      if (shuffled) std::shuffle(map.begin(), map.end(), std::mt19937(5));
      for (auto& l : links) l = {map[l.knot0], map[l.knot1], l.rest, l.axial, l.damping};
      auto o = std::make_unique<Object>();
      o->block = Block(n);
      for (std::uint32_t i = 0, added = 0; i < n; ++i) o->block.addKnot(added);
      for (std::size_t i = 0; i < n; ++i) {
        o->block.row(Block::X)[map[i]] = tube.x[i];
        o->block.row(Block::Y)[map[i]] = tube.y[i];
        o->block.row(Block::Z)[map[i]] = tube.z[i];
        const bool fixed = i < static_cast<std::size_t>(tube.rings);
        o->block.row(Block::kKeep)[i] = fixed ? 0.0f : 0.999f;
        o->block.row(Block::kPush)[i] = fixed ? 0.0f : 0.00005f / 0.0001f;  // dt 0.05 ms, 0.1 g a knot
        o->block.row(Block::HZ)[i] = -9.81f * 0.0001f;                      // weight
      }
      o->table = LinkTable(links, law());
      links_ += links.size();
      objects_.push_back(std::move(o));
    }
  }
  struct Object {
    Block block;  // as in a World's State
    LinkTable table;
  };
  std::vector<std::unique_ptr<Object>> objects_;
  std::size_t links_ = 0;
};

#if defined(VEST_HAVE_BULLET)
/// Bullet's soft bodies on the same net: one position iteration a step, no collisions.
class BulletNet {
 public:
  BulletNet() {
    info_.m_broadphase = &broadphase_;
    info_.m_dispatcher = &dispatcher_;
    info_.m_sparsesdf.Initialize();
    info_.m_gravity = btVector3(0, 0, -9.81f);
    for (const auto& tube : specimen::makeSeedNet(0.5f, 0.001f)) {
      const std::size_t n = tube.x.size() - 2 * kLanes;
      std::vector<btVector3> x(n);
      std::vector<btScalar> m(n, 0.0001f);
      for (std::size_t i = 0; i < n; ++i) x[i] = btVector3(tube.x[i], tube.y[i], tube.z[i]);
      auto body = std::make_unique<btSoftBody>(&info_, static_cast<int>(n), x.data(), m.data());
      for (const auto& l : tube.links) body->appendLink(static_cast<int>(l.knot0), static_cast<int>(l.knot1));
      for (int i = 0; i < tube.rings; ++i) body->setMass(i, 0);
      body->m_cfg.piterations = 1;
      body->m_cfg.collisions = 0;
      bodies_.push_back(std::move(body));
    }
  }
  void step() {
    for (auto& b : bodies_) b->predictMotion(0.001f);
    for (auto& b : bodies_) b->solveConstraints();
    for (auto& b : bodies_) b->integrateMotion();
  }

 private:
  btSoftBodyWorldInfo info_;
  btDbvtBroadphase broadphase_;
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  std::vector<std::unique_ptr<btSoftBody>> bodies_;
};
#endif

}  // namespace vest::bench

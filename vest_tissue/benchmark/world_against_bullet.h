#pragma once

// World::step against Bullet's soft bodies at equal error: 21 tubes of linear springs under gravity, held at
// their ends, nothing damped, for 50 ms. Both are compared with one fine integration in double precision.
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "measure.h"
#include "nets.h"
#include "nets_in_kernel.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::bench {

inline constexpr int kMilliseconds = 50;

/// The seed scene's counts as a scene: what a World does in a step is all there, contact search included.
inline scene::Description fallingTubes() {
  scene::Description d = specimen::seedSizeScene(false);
  for (auto& o : d.objects) {
    o.law = material::Law{};
    o.law.youngs_modulus = 1.5e5;  // about 100 N/m a spring
    for (auto& l : o.links) l.damping = 0.0;
    for (auto& c : o.damping) c = 0.0;
    o.hinges.clear();
  }
  return d;
}
/// The same with the links' and knots' damping, and with the hinges, of the seed's counts.
inline scene::Description damped(scene::Description d) {
  const scene::Description whole = specimen::seedSizeScene(false);
  for (std::size_t i = 0; i < d.objects.size(); ++i) {
    for (std::size_t k = 0; k < d.objects[i].links.size(); ++k)
      d.objects[i].links[k].damping = whole.objects[i].links[k].damping;
    d.objects[i].damping = whole.objects[i].damping;
  }
  return d;
}
inline scene::Description hinged(scene::Description d) {
  const scene::Description whole = specimen::seedSizeScene(false);
  for (std::size_t i = 0; i < d.objects.size(); ++i) d.objects[i].hinges = whole.objects[i].hinges;
  return d;
}

/// Places of all knots of all objects, m.
using Places = std::vector<Eigen::Vector3d>;

inline double springOf(const scene::Object& o, const scene::Link& l) {
  return o.law.youngs_modulus * l.area / l.rest;  // N/m
}

/// Leapfrog of 2 µs in double precision.
inline Places reference(const scene::Description& d) {
  constexpr double h = 2e-6;
  Places out;
  for (const auto& o : d.objects) {
    const std::size_t n = o.position.size();
    Places x = o.position, v(n, Eigen::Vector3d::Zero()), f(n);
    const int steps = static_cast<int>(std::lround(1e-3 * kMilliseconds / h));
    for (int s = 0; s < steps; ++s) {
      for (std::size_t i = 0; i < n; ++i) f[i] = o.mass[i] * d.gravity;
      for (const auto& l : o.links) {
        const Eigen::Vector3d u = x[l.knot1] - x[l.knot0];
        const double length = u.norm();
        const Eigen::Vector3d pull = (springOf(o, l) * (length - l.rest) / length) * u;
        f[l.knot0] += pull, f[l.knot1] -= pull;
      }
      for (std::size_t i = 0; i < n; ++i) {
        if (o.fixed[i]) continue;
        v[i] += ((s == 0 ? 0.5 : 1.0) * h / o.mass[i]) * f[i];
        x[i] += h * v[i];
      }
    }
    out.insert(out.end(), x.begin(), x.end());
  }
  return out;
}

/// Root mean square of the difference over that of the way from the start.
inline double errorOf(const scene::Description& d, const Places& fine, const Places& x) {
  double off = 0.0, way = 0.0;
  std::size_t i = 0;
  for (const auto& o : d.objects)
    for (const auto& start : o.position)
      off += (x[i] - fine[i]).squaredNorm(), way += (fine[i] - start).squaredNorm(), ++i;
  return std::sqrt(off / way);
}

struct Run {
  double microseconds = 0.0;  ///< a simulated millisecond
  double error = 0.0;         ///< no unit
  int sub_steps = 0;          ///< a millisecond
};

inline Run runWorld(const scene::Description& d, const Places& fine, int threads = 1) {
  scene::World w(d, threads);
  scene::StepInput in;
  scene::StepReport report;
  const auto step = [&] { in.step = w.steps(), w.step(in, report); };
  for (int i = 0; i < kMilliseconds; ++i) step();
  Places x;
  for (std::size_t o = 0; o < w.objectCount(); ++o)
    for (std::size_t k = 0; k < w.knotCount(o); ++k) x.push_back(w.knotAt(o, k));
  Run r;
  r.error = errorOf(d, fine, x);
  r.microseconds = microseconds(step, 40, 10);
  return r;
}

struct Load {
  double microseconds = 0.0;  ///< a simulated millisecond
  std::size_t contacts = 0;   ///< of tools with triangles, in the last step
};

/// A step of a session: so many closed graspers come down on a tube each, 2 mm deep.
inline Load runLoad(const scene::Description& d, int tools) {
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  const auto step = [&](int i) {
    for (std::size_t t = 0; t < static_cast<std::size_t>(tools); ++t) {
      if (i <= 200) {  // knot 66: the upper one of a ring in the middle
        const double above = i < 100 ? 0.01 : 0.01 - 0.012 * (i - 100) / 100.0;  // m
        in.tools[t] = specimen::grasper(w.knotAt(15 + t, 66) + Eigen::Vector3d(0, 0, above), 0.0);
      }
    }
    in.step = w.steps(), w.step(in, report);
  };
  for (int i = 0; i <= 300; ++i) step(i);
  Load load;
  load.microseconds = microseconds([&] { step(300); }, 40, 10);
  load.contacts = w.state().sides.size();
  return load;
}

#if defined(VEST_HAVE_BULLET)
/// One iteration a sub-step; each link's stiffness is the one that gives its spring at that sub-step (the
/// compliance k·h²·w/(1 + k·h²·w) of XPBD): Bullet's own number has no unit.
inline Run runBullet(const scene::Description& d, const Places& fine, int sub_steps) {
  btSoftBodyWorldInfo info;
  btDbvtBroadphase broadphase;
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  info.m_broadphase = &broadphase;
  info.m_dispatcher = &dispatcher;
  info.m_sparsesdf.Initialize();
  info.m_gravity = btVector3(btScalar(d.gravity.x()), btScalar(d.gravity.y()), btScalar(d.gravity.z()));
  const double h = 1e-3 / sub_steps;
  std::vector<std::unique_ptr<btSoftBody>> bodies;
  for (const auto& o : d.objects) {
    std::vector<btVector3> x;
    std::vector<btScalar> m;
    for (std::size_t i = 0; i < o.position.size(); ++i) {
      x.emplace_back(btScalar(o.position[i].x()), btScalar(o.position[i].y()), btScalar(o.position[i].z()));
      m.push_back(o.fixed[i] ? btScalar(0) : btScalar(o.mass[i]));
    }
    auto body = std::make_unique<btSoftBody>(&info, static_cast<int>(x.size()), x.data(), m.data());
    for (const auto& l : o.links) {
      const double w =
          (o.fixed[l.knot0] ? 0.0 : 1.0 / o.mass[l.knot0]) + (o.fixed[l.knot1] ? 0.0 : 1.0 / o.mass[l.knot1]);
      const double stiff = springOf(o, l) * h * h * w;
      btSoftBody::Material* const material = body->appendMaterial();
      material->m_kLST = btScalar(std::max(stiff / (1.0 + stiff), 1e-9));
      body->appendLink(static_cast<int>(l.knot0), static_cast<int>(l.knot1), material);
    }
    body->m_cfg.piterations = 1;
    body->m_cfg.collisions = 0;
    body->m_cfg.kDP = 0;
    bodies.push_back(std::move(body));
  }
  const auto millisecond = [&] {
    for (int s = 0; s < sub_steps; ++s) {
      for (auto& b : bodies) b->predictMotion(btScalar(h));
      for (auto& b : bodies) b->solveConstraints();
      for (auto& b : bodies) b->integrateMotion();
    }
  };
  for (int i = 0; i < kMilliseconds; ++i) millisecond();
  Places x;
  for (const auto& b : bodies)
    for (int i = 0; i < b->m_nodes.size(); ++i)
      x.emplace_back(b->m_nodes[i].m_x.x(), b->m_nodes[i].m_x.y(), b->m_nodes[i].m_x.z());
  Run r;
  r.sub_steps = sub_steps;
  r.error = errorOf(d, fine, x);
  r.microseconds = microseconds(millisecond, 10, 1);
  return r;
}
#endif

}  // namespace vest::bench

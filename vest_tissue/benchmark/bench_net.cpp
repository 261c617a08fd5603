// µs per step of a net of the seed scene's size, and the ratio to Bullet's soft body on the same net in the
// same run. rosrun vest_tissue vest_bench_net
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>

#include "seed_net.h"
#include "vest_tissue/net/link_kernel.h"

#if defined(VEST_HAVE_BULLET)
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#endif

namespace {

using namespace vest::net;

vest::material::Law law() {
  vest::material::Law l;
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
  explicit Net(bool shuffled) {
    for (auto& tube : vest::test::makeSeedNet(0.5f, 0.001f)) {
      const std::size_t n = tube.x.size() - 2 * kLanes;
      auto links = tube.links;
      std::vector<std::uint32_t> map(n);
      for (std::size_t i = 0; i < n; ++i) map[i] = static_cast<std::uint32_t>(i);
      if (shuffled) std::shuffle(map.begin(), map.end(), std::mt19937(5));
      for (auto& l : links) l = {map[l.knot0], map[l.knot1], l.rest, l.axial, l.damping};
      auto o = std::make_unique<Object>();
      o->n = n;
      // Odd multiples of the cache line between arrays: no 4 KiB aliasing.
      o->stride = (n + 2 * kLanes + 15) / 16 * 16 + 16;
      o->data.assign(o->stride * (14 + kPackedFloats), 0.0f);
      for (std::size_t i = 0; i < n; ++i) {
        o->at(0)[map[i]] = tube.x[i];
        o->at(1)[map[i]] = tube.y[i];
        o->at(2)[map[i]] = tube.z[i];
        o->at(9)[i] = i < static_cast<std::size_t>(tube.rings) ? 0.0f : 0.999f;
        o->at(10)[i] =
            i < static_cast<std::size_t>(tube.rings) ? 0.0f : 0.00005f / 0.0001f;  // dt 0.05 ms, 0.1 g a knot
        o->at(13)[i] = -9.81f * 0.0001f;                                           // weight
      }
      o->table = LinkTable(links, law());
      links_ += links.size();
      objects_.push_back(std::move(o));
    }
  }
  void step(KernelLevel level) {
    for (auto& o : objects_) {
      addLinkForces(o->table,
                    {o->at(0), o->at(1), o->at(2), o->at(3), o->at(4), o->at(5), o->at(6), o->at(7), o->at(8),
                     o->at(14)},
                    level);
      MotionArrays m{};
      m.n = (o->n + kLanes - 1) / kLanes * kLanes;
      m.x = o->at(0), m.y = o->at(1), m.z = o->at(2), m.vx = o->at(3), m.vy = o->at(4), m.vz = o->at(5);
      m.fx = o->at(6), m.fy = o->at(7), m.fz = o->at(8), m.keep = o->at(9), m.push = o->at(10);
      m.hx = o->at(11), m.hy = o->at(12), m.hz = o->at(13);
      integrateKnots(m, 0.00005f, level);
    }
  }
  std::size_t links() const { return links_; }

 private:
  struct Object {
    std::size_t n = 0, stride = 0;
    std::vector<float> data;
    LinkTable table;
    float* at(int k) { return data.data() + stride * k; }
  };
  std::vector<std::unique_ptr<Object>> objects_;
  std::size_t links_ = 0;
};

void kernelStep(benchmark::State& state, bool shuffled, KernelLevel level) {
  Net net(shuffled);
  for (auto _ : state) net.step(level);
  state.counters["links/s"] =
      benchmark::Counter(static_cast<double>(net.links()) * state.iterations(), benchmark::Counter::kIsRate);
}

#if defined(VEST_HAVE_BULLET)
/// Bullet's soft bodies on the same net: one position iteration a step, no collisions.
class BulletNet {
 public:
  BulletNet() {
    info_.m_broadphase = &broadphase_;
    info_.m_dispatcher = &dispatcher_;
    info_.m_sparsesdf.Initialize();
    info_.m_gravity = btVector3(0, 0, -9.81f);
    for (const auto& tube : vest::test::makeSeedNet(0.5f, 0.001f)) {
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

void bulletStep(benchmark::State& state) {
  BulletNet net;
  for (auto _ : state) net.step();
}
#endif

template <class F>
double microseconds(F&& step) {
  // Median of short batches: a shared machine stalls now and then.
  std::vector<double> times;
  for (int batch = 0; batch < 60; ++batch) {
    const auto begin = std::chrono::steady_clock::now();
    for (int n = 0; n < 20; ++n) step();
    times.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count() / 20);
  }
  std::nth_element(times.begin(), times.begin() + 30, times.end());
  return times[30];
}

void printRatios() {
  Net runs(false), any(true);
  const KernelLevel level = chooseKernelLevel();
  const double t_runs = microseconds([&] { runs.step(level); });
  const double t_any = microseconds([&] { any.step(level); });
  std::printf("kernel level %s\nkernel step, runs          %8.2f us\nkernel step, any topology  %8.2f us\n",
              kernelLevelName(level).data(), t_runs, t_any);
#if defined(VEST_HAVE_BULLET)
  BulletNet bullet;
  const double t_bullet = microseconds([&] { bullet.step(); });
  std::printf("Bullet soft body, 1 iter.  %8.2f us\nratio to Bullet: runs %.1f, any topology %.1f\n",
              t_bullet, t_bullet / t_runs, t_bullet / t_any);
#else
  std::printf("Bullet is not installed (libbullet-dev): no ratio\n");
#endif
}

}  // namespace

BENCHMARK_CAPTURE(kernelStep, runs_baseline, false, KernelLevel::Baseline)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(kernelStep, runs_best, false, chooseKernelLevel())->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(kernelStep, any_best, true, chooseKernelLevel())->Unit(benchmark::kMicrosecond);
#if defined(VEST_HAVE_BULLET)
BENCHMARK(bulletStep)->Unit(benchmark::kMicrosecond);
#endif

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  printRatios();
  return 0;
}

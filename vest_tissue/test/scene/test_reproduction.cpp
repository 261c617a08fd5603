#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "blades.h"
#include "nets.h"
#include "slab.h"
#include "vest_tissue/scene/world_model.h"

// Every allocation of this program, of any thread, passes here; inside a step each one counts: operator new,
// also the aligned one, Eigen, C libraries.
namespace {
std::atomic<bool> forbid_allocation{false};
std::atomic<int> allocations{0};
void count() {
  if (forbid_allocation.load(std::memory_order_relaxed)) ++allocations;
}
}  // namespace
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) {
  count();
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  count();
  *p = __libc_memalign(alignment, size);
  return *p == nullptr ? 12 : 0;  // ENOMEM
}
}

namespace {

using namespace vest;
using Eigen::Vector3d;

/// Two graspers at work on the connected tubes.
scene::StepInput inputOf(int i) {
  scene::StepInput in;
  in.step = i;
  const double down = std::min(1.0, i / 150.0), jaw = 1.0 - 0.95 * std::clamp((i - 150) / 100.0, 0.0, 1.0);
  const double up = std::clamp((i - 260) / 200.0, 0.0, 1.0);
  in.tools[0] = specimen::grasper(Vector3d(-0.01, 0.024, 0.090 - 0.022 * down + 0.02 * up), jaw);
  in.tools[0].pivot = Vector3d(-0.01, 0.024, 0.2);
  in.tools[1] = specimen::grasper(Vector3d(0.02, 0.048, 0.090 - 0.022 * down + 0.02 * up), jaw);
  in.tools[1].pivot = Vector3d(0.02, 0.048, 0.2);
  if (i == 100) in.edits.push_back({"tube_3", "damping_scale", 2.0});
  if (i == 120) in.impacts.push_back({2, 10, {0.3, 0.3, 0.4}, Vector3d(0, 0, -1e-5)});
  if (i == 130 || i == 180) {
    in.load_over = 0.048;
    for (std::uint32_t k = 10; k < 60; ++k)
      in.loads.push_back({static_cast<std::uint16_t>(i == 130 ? 4 : 5), k, {1e-5f, 0, -2e-5f}, 1e-4f});
  }
  return in;
}

std::vector<std::uint64_t> run(int threads, const char* level) {
  if (level != nullptr)
    setenv("VEST_KERNEL", level, 1);
  else
    unsetenv("VEST_KERNEL");
  scene::World w(specimen::seedSizeScene(), threads);
  unsetenv("VEST_KERNEL");
  scene::StepReport report;
  std::vector<std::uint64_t> hashes;
  for (int i = 0; i < 500; ++i) {
    EXPECT_NE(w.step(inputOf(i), report), scene::Status::Fault);
    if (i % 100 == 99) hashes.push_back(w.stateHash());
  }
  return hashes;
}

TEST(Reproduction, TheHashIsTheSameForAnyThreadsAndKernelLevel) {
  const auto reference = run(1, nullptr);
  ASSERT_EQ(reference.size(), 5u);
  EXPECT_NE(reference[0], reference[1]);
  for (const int threads : {2, 4, 8}) EXPECT_EQ(run(threads, nullptr), reference) << threads << " threads";
  EXPECT_EQ(run(1, "baseline"), reference);
  EXPECT_EQ(run(2, "avx2"), reference);
}

TEST(Reproduction, ARestoredWorldGoesOnExactlyLikeTheOneThatWasSaved) {
  scene::World live(specimen::seedSizeScene());
  scene::StepReport report;
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 303; ++i) live.step(inputOf(i), report);
  live.save(bytes);
  scene::World other(specimen::seedSizeScene());
  other.restore(bytes);
  EXPECT_EQ(other.stateHash(), live.stateHash());
  for (int i = 303; i < 420; ++i) {
    live.step(inputOf(i), report);
    other.step(inputOf(i), report);
  }
  EXPECT_EQ(other.stateHash(), live.stateHash());
}

TEST(Reproduction, ResetReturnsToTheStart) {
  scene::World w(specimen::seedSizeScene());
  const auto start = w.stateHash();
  scene::StepReport report;
  for (int i = 0; i < 20; ++i) w.step(inputOf(i), report);
  EXPECT_NE(w.stateHash(), start);
  w.reset();
  EXPECT_EQ(w.stateHash(), start);
}

TEST(Reproduction, ADamagedSnapshotIsRefusedAndChangesNothing) {
  scene::World w(specimen::tubeScene());
  std::vector<std::uint8_t> bytes;
  w.save(bytes);
  const auto hash = w.stateHash();
  for (std::size_t cut = 0; cut < bytes.size(); cut += 997) {
    const std::vector<std::uint8_t> part(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(cut));
    EXPECT_THROW(w.restore(part), std::invalid_argument);
  }
  auto other = specimen::tubeScene();
  other.hash = "ffffffffffffffff";
  scene::World stranger(other);
  EXPECT_THROW(stranger.restore(bytes), std::invalid_argument) << "of another scene";
  EXPECT_EQ(w.stateHash(), hash);
}

TEST(RealTime, AStepAllocatesNothingInAnyThread) {
  scene::World w(specimen::seedSizeScene(), 3);
  scene::StepReport report;
  w.step(inputOf(0), report);
  int worst = 0;
  for (int i = 1; i < 420; ++i) {
    const auto in = inputOf(i);
    allocations = 0;
    forbid_allocation = true;
    w.step(in, report);
    forbid_allocation = false;
    worst = std::max(worst, allocations.load());
  }
  EXPECT_EQ(worst, 0);
  // The trap itself works.
  allocations = 0;
  forbid_allocation = true;
  struct alignas(128) Wide {
    double value[16] = {};
  };
  auto wide = std::make_unique<Wide>();
  const int after_aligned = allocations;
  Eigen::VectorXd vector = Eigen::VectorXd::Constant(1000 + after_aligned, 1.0);
  const int after_eigen = allocations;
  std::thread([&wide] {
    wide->value[0] = std::vector<double>(100 + static_cast<std::size_t>(wide->value[1]))[7];
  }).join();
  forbid_allocation = false;
  EXPECT_EQ(vector.sum() + wide->value[0], 1000.0 + after_aligned);
  EXPECT_GE(after_aligned, 1);
  EXPECT_GT(after_eigen, after_aligned);
  EXPECT_GE(allocations, after_eigen + 2) << "the thread, and what it asks for";
}

fem::Description bar(fem::Strain strain, fem::Motion motion) {
  fem::Description d = fem::specimen::makeBox({10, 3, 2, 0.04, 0.008, 0.004});
  d.name = "bar";
  d.strain = strain, d.motion = motion;
  d.material = {100e3, 0.45, 1050.0, 4.0, 0.004};
  for (auto& x : d.nodes) x += Vector3d(-0.02, -0.004, 0.048);
  return d;
}

/// One tool after the other on an object about (0, 0, 50 mm): a clip is set, a hook burns, jaws hang it up, a
/// loop is drawn, scissors divide. Counts what steps allocate, by either of two threads, after the first one.
struct Operation {
  scene::World world;
  scene::StepInput in;
  scene::StepReport report;
  std::map<scene::EventKind, int> events;
  int worst = 0;
  explicit Operation(const scene::Description& d) : world(d, 2) {
    in.requests.reserve(4);
    step();
    worst = 0;
  }
  void step() {
    in.step = world.steps();
    allocations = 0;
    forbid_allocation = true;
    const auto status = world.step(in, report);
    forbid_allocation = false;
    worst = std::max(worst, allocations.load());
    EXPECT_NE(status, scene::Status::Fault) << report.fault_object;
    for (const auto& e : report.events) ++events[e.kind];
  }
  void use(tools::ToolKind kind, const Vector3d& tip, double jaw0, double jaw1, int steps,
           std::uint32_t functions = 0) {
    for (int i = 1; i <= steps; ++i) {
      in.tools[1] = specimen::toolAt(kind, tip, -Vector3d::UnitZ(), Vector3d::UnitY(),
                                     jaw0 + (jaw1 - jaw0) * i / steps);
      in.tools[1].functions = functions;
      step();
    }
  }
  /// @param draw steps of 10 ms that the loop is drawn
  void all(int draw) {
    using tools::ToolKind;
    use(ToolKind::ClipApplier, Vector3d(-0.012, 0, 0.0465), 0.6, 0.6, 10);
    use(ToolKind::ClipApplier, Vector3d(-0.012, 0, 0.0465), 0.6, 0.0, 100);
    use(ToolKind::ClipApplier, Vector3d(-0.012, 0, 0.0465), 0.0, 0.6, 20);
    use(ToolKind::CoagulationHook, Vector3d(-0.002, 0, 0.0645), 0.0, 0.0, 30);
    use(ToolKind::CoagulationHook, Vector3d(-0.002, 0, 0.0645), 0.0, 0.0, 150, tools::kFunctionCoagulate);
    for (int twice = 0; twice < 2; ++twice) {  // hung up, and taken off
      use(ToolKind::Grasper, Vector3d(0.004, 0, 0.050), 0.8, 0.8, 20);
      use(ToolKind::Grasper, Vector3d(0.004, 0, 0.050), 0.8, 0.0, 100);
      use(ToolKind::Grasper, Vector3d(0.004, 0, 0.050), 0.0, 0.0, 20, tools::kFunctionSuspend);
      use(ToolKind::Grasper, Vector3d(0.004, 0, 0.050), 0.0, 0.8, 50);
    }
    use(ToolKind::Scissors, Vector3d(0.010, 0, 0.046), 0.8, 0.0, 150);
    use(ToolKind::Scissors, Vector3d(0.010, 0, 0.046), 0.0, 0.0, 50);
    use(ToolKind::SlingApplicator, Vector3d(0.0, 0, 0.080), 0.0, 0.0, 5);
    in.dt = 0.01;
    use(ToolKind::SlingApplicator, Vector3d(0.0, 0, 0.080), 0.0, 0.0, draw, tools::kFunctionFire);
    in.dt = 0.001;
  }
};

TEST(RealTime, StepsThatCutClipBurnAndDrawLoopsAllocateNothing) {
  using fem::Motion;
  using fem::Strain;
  specimen::TubeOptions soft;
  soft.length = 0.04, soft.rings = 10, soft.around = 6;
  specimen::TubeOptions hard = soft;  // stepped implicitly
  hard.youngs_modulus = 1e9;
  std::vector<scene::Description> scenes{specimen::tubeScene(soft), specimen::tubeScene(hard)};
  for (auto& s : scenes) s.objects[0].wall_thickness = 0.001;
  for (const auto& [strain, motion] : {std::pair{Strain::Small, Motion::BackwardEuler},
                                       std::pair{Strain::Corotational, Motion::BackwardEuler},
                                       std::pair{Strain::Small, Motion::Elastostatic}})
    scenes.push_back(fem::specimen::sceneOf({fem::specimen::object(bar(strain, motion))}));
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    Operation o(scenes[i]);
    EXPECT_EQ(o.world.model().objects[0].implicit, i == 1);
    o.all(i == 1 ? 5 : 120);  // steps of the implicit net are dear
    EXPECT_EQ(o.worst, 0) << "scene " << i;
    EXPECT_GE(o.events[scene::EventKind::Cut], 1) << "scene " << i;
    EXPECT_GE(o.events[scene::EventKind::Clipped], 1) << "scene " << i;
    EXPECT_GE(o.events[scene::EventKind::Suspended], 1) << "scene " << i;
    EXPECT_GT(o.world.heat().delivered, 0.0) << "scene " << i;
    EXPECT_GE(o.world.state().fasteners.slings.size(), 1u) << "scene " << i;
    std::printf("scene %zu: %d cuts, %d clips, %d coagulations, %d ligatures\n", i,
                o.events[scene::EventKind::Cut], o.events[scene::EventKind::Clipped],
                o.events[scene::EventKind::Coagulated], o.events[scene::EventKind::Ligated]);
  }
}

}  // namespace

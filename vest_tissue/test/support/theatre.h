#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "nets.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::test {

/// A World under instruments: what goes in, what it said, everything that happened.
struct Theatre {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  std::vector<scene::Event> events;
  scene::Status worst = scene::Status::Degraded;  ///< that a step may end with

  explicit Theatre(const scene::Description& d, int threads = 1) : world(d, threads) {}
  void step() {
    input.step = world.steps();
    ASSERT_LE(world.step(input, report), worst) << std::string(report.fault_object);
    events.insert(events.end(), report.events.begin(), report.events.end());
  }
  void run(int steps) {
    for (int i = 0; i < steps && !testing::Test::HasFatalFailure(); ++i) step();
  }
  /// An instrument from above, its jaws open along y from `jaw0` to `jaw1` rad.
  void use(tools::ToolKind kind, const Eigen::Vector3d& tip, double jaw0, double jaw1, int steps,
           std::uint32_t functions = 0) {
    for (int i = 1; i <= steps; ++i) {
      auto& t = input.tools[1];
      t = specimen::grasper(tip, jaw0 + (jaw1 - jaw0) * i / steps);
      t.tool = kind, t.functions = functions;
      t.pivot = Eigen::Vector3d(tip.x(), tip.y(), 0.2);
      step();
    }
  }
  void leave() { input.tools[1].present = false; }
  std::size_t count(scene::EventKind kind) const {
    return static_cast<std::size_t>(
        std::count_if(events.begin(), events.end(), [&](const auto& e) { return e.kind == kind; }));
  }
  bool saw(scene::EventKind kind) const { return count(kind) > 0; }
  /// The first one; null: none.
  const scene::Event* event(scene::EventKind kind) const {
    const auto found =
        std::find_if(events.begin(), events.end(), [&](const auto& e) { return e.kind == kind; });
    return found == events.end() ? nullptr : &*found;
  }
  std::vector<float> field(scene::Field kind) const {
    std::vector<float> v(world.knotCount(0));
    world.field(0, kind, v.data());
    return v;
  }
  float most(scene::Field kind) const {
    const auto v = field(kind);
    return *std::max_element(v.begin(), v.end());
  }
};

}  // namespace vest::test

#pragma once

#include <algorithm>
#include <string>

#include <Eigen/Geometry>

#include "blades.h"
#include "measure.h"
#include "vest_tissue/scene/world.h"

namespace vest::bench {

/// µs of processor time of a step of 1 ms, means over all steps.
struct SlabUnderLoad {
  double whole = 0;    ///< before anything touches it
  double cutting = 0;  ///< while scissors come, close and draw back
  double alone = 0;    ///< once cut, without any instrument
  std::size_t cuts = 0;
};

/// The shipped slab of finite elements with its tube, as a session cuts it: a pair of scissors goes along the
/// slab and under the tube and closes every 120 ms.
inline SlabUnderLoad slabUnderLoad(const std::string& scene) {
  constexpr int kPlaces = 24, kClosing = 120, kAlone = 1000, kWhole = 200;
  const scene::Description description = scene::loadScene(scene);
  Eigen::AlignedBox3d box;
  for (const auto& x : description.objects[0].position) box.extend(x);
  scene::World world(description);
  scene::StepInput input;
  scene::StepReport report;
  SlabUnderLoad load;
  const auto run = [&](int steps, auto&& place) {
    const double begin = cpuNow();
    for (int i = 0; i < steps; ++i) {
      place(i);
      input.step = world.steps();
      world.step(input, report);
      load.cuts += static_cast<std::size_t>(
          std::count_if(report.events.begin(), report.events.end(),
                        [](const scene::Event& e) { return e.kind == scene::EventKind::Cut; }));
    }
    return (cpuNow() - begin) / steps;
  };
  load.whole = run(kWhole, [](int) {});
  load.cutting = run(kPlaces * kClosing, [&](int i) {
    const int n = i / kClosing;
    const double t = static_cast<double>(i % kClosing) / kClosing;  // opens and comes, closes, draws back
    const double along = (n + 0.5) / kPlaces, across = 0.25 + 0.5 * (n % 3) / 2.0;
    const Eigen::Vector3d at(box.min().x() + along * box.sizes().x(),
                             box.min().y() + across * box.sizes().y(),
                             box.max().z() - 0.003 + 0.02 * std::max({0.0, 1 - 3 * t, 3 * t - 2}));
    input.tools[1] = specimen::toolAt(tools::ToolKind::Scissors, at, {0.2, 0.1, -1.0}, {0.0, 1.0, 0.1},
                                      0.9 * std::clamp(2 - 3 * t, 0.0, 1.0));
  });
  input.tools[1].present = false;
  load.alone = run(kAlone, [](int) {});
  return load;
}

}  // namespace vest::bench

/// A hand at work in a scene, without ROS: device, loop, trocar and tissue in one thread, a millisecond at a
/// time.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vest_haptics/device/device.h"
#include "vest_haptics/loop/loop.h"
#include "vest_tissue/scene/world.h"

namespace vest::haptics {

/// One millisecond of a trial.
struct TrialSample {
  double time = 0.0;                                ///< s since the trial's start
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();    ///< m, world: where the hand holds the tip
  Eigen::Vector3d asked = Eigen::Vector3d::Zero();  ///< N, world: what the newest model asks for
  Eigen::Vector3d shown = Eigen::Vector3d::Zero();  ///< N, world: what the device shows
  Loads loads{};                                    ///< to the device
  bool contact = false, grasping = false;
  double jaw = 0.0;          ///< rad
  double allowance = 0.0;    ///< of the gate
  std::uint32_t limits = 0;  ///< LimitFlag
};

/// Device → loop → trocar → World → contact memory → loop. The memory is the real one, of a name of its own.
class Trial {
 public:
  /// @param device open. @param options whose instrument and arm @throws std::runtime_error as ContactWriter
  Trial(scene::World& world, tools::ToolKind tool, Device& device, const ControllerOptions& options);

  /// @param now_ns steady; grows by a millisecond a call for simulated devices, is the clock for others
  /// @param jaw rad: the handle, which few devices have. @param steps of the simulation after the tick
  const TrialSample& tick(std::int64_t now_ns, double jaw, int steps = 1);
  const scene::StepReport& step() const { return report_; }
  Loop& loop() { return loop_; }
  /// What the next tick's first step shall change, e.g. a link that parts.
  void request(const scene::TopologyRequest& request) { input_.requests.push_back(request); }

 private:
  scene::World& world_;
  Device& device_;
  ControllerOptions options_;
  control::Instrument instrument_;
  std::shared_ptr<shared::ContactReader> reader_;
  shared::ContactWriter writer_;
  Loop loop_;
  scene::StepInput input_;
  scene::StepReport report_;
  shared::ContactImage image_;
  std::int64_t began_ = -1;
  TrialSample sample_;
};

/// Writes samples as CSV: t_s, tip, forces, flags. @throws std::runtime_error
void writeSamples(const std::string& path, const std::vector<TrialSample>& samples);

}  // namespace vest::haptics

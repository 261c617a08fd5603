#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include <rosbag/bag.h>

#include "vest_bringup/simulation/stage.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace vest::ros_shell {

/// Moments of a rehearsal as a session would have recorded them, so that vest_render draws them: topology,
/// state with all fields, attachments, slings, instruments, surfaces, fluid, smoke, lens. Stamped with
/// simulated time.
class MomentBag {
 public:
  /// @throws std::invalid_argument where the file cannot be written, or is no ordinary file
  explicit MomentBag(const std::string& file);
  /// Buffers that the stage fills; hand them to makeStage().
  simulation::StageFrames frames() { return {&gas_, nullptr, &surface_, field_}; }
  /// Whether the surfaces' frame is of the world's topology: it comes at 10 Hz only, and a film of blood on
  /// knots that have been cut since is not drawn. Wait for it before write().
  bool current(const scene::World& world);
  /// The world after the step that consumed `input`, t s since the beginning.
  /// @throws std::invalid_argument where the file cannot be written; it is removed
  void write(double t, const scene::World& world, const kinematics::TrainerBox& box,
             const scene::StepInput& input);
  /// Nothing may be written afterwards. @throws as write()
  void close();

 private:
  template <class M>
  void put(const std::string& topic, ros::Time& time,
           M& message);  ///< each a little later than the one before

  [[noreturn]] void giveUp();

  std::string file_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  scene::TripleBuffer<simulation::GasFrame> gas_;
  scene::TripleBuffer<simulation::SurfaceFrame> surface_;
  bool has_surface_ = false;  ///< that has not been written
  std::shared_ptr<simulation::FieldFrames> field_ = std::make_shared<simulation::FieldFrames>();
  std::array<kinematics::JointPositions, tools::kInstrumentCount> joints_{};
  std::uint32_t revision_ = 0;  ///< of the topology that was written last
  std::string scene_hash_;
};

}  // namespace vest::ros_shell

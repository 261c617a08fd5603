#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vest_bringup/simulation/trainer.h"
#include "vest_tissue/scene/world.h"

namespace vest::session {

/// Steps a World through recorded inputs and compares the hashes of its State with recorded ones.
class Resimulation {
 public:
  /// The World outlives it.
  explicit Resimulation(scene::World& world) : world_(world) {}

  /// Begins at a snapshot instead of the scene. @throws std::invalid_argument naming what does not fit
  void begin(const std::vector<std::uint8_t>& snapshot) {
    const auto world = static_cast<std::ptrdiff_t>(simulation::worldBytes(snapshot));
    world_.restore(std::vector<std::uint8_t>(snapshot.begin(), snapshot.begin() + world));
  }

  /// @param reset resets the World first  @param jumps the step's number starts anew
  /// @return number of a step that is missing before this one; the World did not move then
  std::optional<std::uint64_t> step(const scene::StepInput& input, bool reset, bool jumps) {
    if (reset) world_.reset();
    if (input.step != world_.steps() + 1 && !jumps) return world_.steps() + 1;
    world_.step(input, report_);
    ++steps_;
    return std::nullopt;
  }

  bool compare(std::uint64_t recorded) {
    ++compared_;
    return world_.stateHash() == recorded;
  }

  std::uint64_t steps() const { return steps_; }
  std::uint64_t compared() const { return compared_; }

 private:
  scene::World& world_;
  scene::StepReport report_;
  std::uint64_t steps_ = 0, compared_ = 0;
};

}  // namespace vest::session

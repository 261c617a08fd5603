#pragma once

#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "vest_bringup/simulation/effect.h"
#include "vest_tissue/scene/runner.h"

/// The ROS-free composite: instruments' input, tissue and effects in lockstep.
namespace vest::simulation {

/// Last bytes of a snapshot that has effects behind the World: 8 bytes of the World's length, then these.
inline constexpr std::string_view kEffectsMagic = "VESTEFX8";

/// How many of a snapshot's bytes are the World's: all, or those before the effects'.
std::size_t worldBytes(const std::vector<std::uint8_t>& snapshot);

///   input (+ feedback of the step before) -> tissue -> effects -> feedback for the next step
class Trainer : public scene::Simulation {
 public:
  explicit Trainer(scene::World world);

  /// Before the first step. Effects are stepped in the order in which they were added.
  /// @throws std::logic_error where their ports do not fit that order
  void add(std::unique_ptr<Effect> effect);

  scene::Status step(scene::StepInput& input, scene::StepReport& report) override;
  scene::World& world() override { return world_; }
  void reset() override;
  std::vector<std::uint32_t> adopt(scene::Simulation& before) override;
  void save(std::vector<std::uint8_t>& bytes) override;
  /// A snapshot of the World alone is taken too: the effects begin anew then.
  void restore(const std::vector<std::uint8_t>& bytes) override;
  void edits(std::vector<scene::EditableParameter>& out) override;
  /// XXH64 over what save() writes of the effects and the feedback that the next step will consume.
  std::optional<std::uint64_t> effectsHash() override;

 private:
  void saveEffects(std::vector<std::uint8_t>& bytes) const;
  void clearFeedback();

  scene::World world_;
  std::vector<std::unique_ptr<Effect>> effects_;
  Feedback feedback_;
  std::vector<std::uint8_t> hashed_;  // room that stays
};

}  // namespace vest::simulation

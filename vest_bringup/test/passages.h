#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "../../vest_tissue/specimen/crossings.h"
#include "vest_tissue/scene/runner.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::simulation {

/// Counts segments of threads that went through each other, step by step, by the motion of the nodes alone.
/// Where segments cross as all nodes move straight over a step, it looks closer: a strand that whips moves by
/// millimetres, and its parts bend on their way. Then the step is played once more in small ones, from the
/// same state. Nothing has passed where segments cross in none of them, nor on the straight way from there to
/// where the step ended.
class Passages {
 public:
  int passed = 0;         ///< steps
  int closer = 0;         ///< steps that were played once more
  double farthest = 0.0;  ///< m: of a node in one of the small steps

  explicit Passages(scene::Simulation& simulation) : simulation_(simulation), before_(nodes()) {
    simulation.save(kept_);
  }
  /// @param input of the step that has been made
  void look(const scene::StepInput& input) {
    since_.push_back(input);
    if (cross(before_, nodes())) lookCloser();
    before_ = nodes();
    if (since_.size() < kKept) return;
    simulation_.save(kept_);
    since_.clear();
  }

 private:
  static constexpr int kSmall = 32;         // as short as the parts into which threads divide a step
  static constexpr std::size_t kKept = 25;  // steps between two snapshots

  const suture::State& rod() const { return simulation_.world().state().threads.rod; }
  const std::vector<Eigen::Vector3d>& nodes() const { return rod().position; }
  bool cross(const std::vector<Eigen::Vector3d>& was, const std::vector<Eigen::Vector3d>& now) const {
    std::vector<std::size_t> parts;  // what was cut joins nothing
    for (std::size_t i = 0; i < rod().severed.size(); ++i)
      if (rod().severed[i] != 0) parts.push_back(i + 1);
    int all = 0;
    suture::specimen::crossings(was, now, parts, &all);
    return all != 0;
  }
  void lookCloser() {
    const std::vector<Eigen::Vector3d> end = nodes();
    std::vector<std::uint8_t> after;
    simulation_.save(after);
    simulation_.restore(kept_);
    scene::StepReport told;
    for (std::size_t k = 0; k + 1 < since_.size(); ++k) {
      scene::StepInput input = since_[k];
      simulation_.step(input, told);
    }
    EXPECT_EQ(nodes(), before_) << "it was not played once more";
    bool through = false;
    for (int k = 0; k < kSmall; ++k) {
      const std::vector<Eigen::Vector3d> was = nodes();
      scene::StepInput input = since_.back();
      if (k > 0) input.requests.clear(), input.edits.clear(), input.impacts.clear();
      input.step = simulation_.world().steps() + 1;
      input.dt /= kSmall;
      simulation_.step(input, told);
      through = through || cross(was, nodes());
      for (std::size_t i = 0; i < was.size(); ++i)
        farthest = std::max(farthest, (nodes()[i] - was[i]).norm());
    }
    through = through || cross(nodes(), end);
    ++closer, passed += through;
    simulation_.restore(after);
  }

  scene::Simulation& simulation_;
  std::vector<Eigen::Vector3d> before_;
  std::vector<std::uint8_t> kept_;
  std::vector<scene::StepInput> since_;
};

}  // namespace vest::simulation

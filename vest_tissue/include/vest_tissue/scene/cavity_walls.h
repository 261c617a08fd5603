#pragma once

#include <limits>

#include "vest_tissue/base/sunken_wall.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::scene {

/// m/s²: a sunken wall is no clamp. It presses by its weight, on a body by this times the body's mass at
/// most: 4 mm of wall on each mm of tissue (assumed).
constexpr double kWallWeighs = 4 * 9.81;
/// interaction::ThreadTouch::part of a rigid object: where its wall hangs.
constexpr std::uint8_t kHangs = 1;

/// The walls of a scene's cavities where they hang for want of gas. Tissue, threads, instruments, drops,
/// films and smoke ask this one description. Cheap enough to make in each step. It outlives neither model nor
/// state.
class CavityWalls {
 public:
  /// @param sunk m: StepInput::sunk
  CavityWalls(const WorldModel& model, const WorldState& state, double sunk) : model_(model) {
    wall_.sunk = sunk;
    const auto& endoscope = state.proxies[static_cast<std::size_t>(tools::Instrument::Endoscope)];
    wall_.propped = endoscope.present, wall_.lens = endoscope.pose.tip;
  }
  /// Whether it hangs so far that anything meets it.
  bool sink() const { return wall_.sunk > contact::kLeastSunk; }
  bool isCavity(std::size_t object) const {
    return model_.description.objects[object].organ == "cavity" && !model_.objects[object].grid.empty();
  }
  /// How rigid object `object` hangs, if it is a cavity.
  contact::SunkenWall wall(std::size_t object) const {
    contact::SunkenWall w = wall_;
    w.middle = 0.5 * (model_.objects[object].lowest + model_.objects[object].highest);
    w.high = model_.objects[object].highest;
    return w;
  }
  /// Distance (m) from `p` to the wall of rigid object `object`, and its gradient, as if it hung. They are
  /// taken where the hanging wall is nearer than `distance`. @return whether they were
  bool lower(std::size_t object, const Eigen::Vector3f& p, float& distance, Eigen::Vector3f& gradient) const;
  /// Moves knots of rigid object `object` to where they hang. @param xyz m, world, three per knot
  void hang(std::size_t object, float* xyz, std::size_t knots) const;

 private:
  const WorldModel& model_;
  contact::SunkenWall wall_;
};

/// m, world: the highest place of a cavity's room over (x, y), where nothing is missing. NaN: there is none.
/// Searches from above in steps of the grid.
double roofOver(const WorldModel& model, double x, double y);

}  // namespace vest::scene

#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "vest_tissue/interaction/heat.h"
#include "vest_tissue/scene/step_input.h"

namespace vest::scene {

class World;

/// A parameter that edits may change while it runs.
struct EditableParameter {
  std::string object;  ///< as in ParameterEdit
  std::string parameter;
  std::string unit;          ///< empty: no unit
  double low = 0, high = 0;  ///< what is allowed, in that unit
};

/// Of the world, not of an object.
struct WorldParameter {
  std::string_view name, unit;
  double low, high;
};
/// Along each axis, m/s² (tuned: ten times the Earth's). Nets are made for hers; at a thousand times that
/// much what falls freely is faster than a step takes within 0.01 s.
inline constexpr double kMostGravity = 100.0;
inline constexpr std::array<WorldParameter, 5> kWorldParameters{
    {{"gravity_x", "m/s²", -kMostGravity, kMostGravity},
     {"gravity_y", "m/s²", -kMostGravity, kMostGravity},
     {"gravity_z", "m/s²", -kMostGravity, kMostGravity},
     {"monopolar_power", "W", 0.0, interaction::kGreatestPower},
     {"bipolar_power", "W", 0.0, interaction::kGreatestPower}}};
/// Of each deformable object: stiffness and damping over the scene's.
inline constexpr double kLeastScale = 0.01, kGreatestScale = 100.0;

/// Appends what edits of this World may change. Reads what never changes: any thread.
void editableParameters(const World& world, std::vector<EditableParameter>& out);

/// Why an edit is none of these, in one sentence: field, value, what is allowed. Empty where it is one. (A
/// step takes whatever was recorded: it sets what is beyond a range to its end, and leaves out what it does
/// not know.)
std::string refusal(const std::vector<EditableParameter>& allowed, const ParameterEdit& edit);

}  // namespace vest::scene

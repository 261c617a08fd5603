#pragma once

#include <string>
#include <vector>

#include "vest_tissue/material/database.h"
#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Gives an object what the database says of its tissue, but for elasticity, density and the water in it:
/// heat capacity and conductivity, perfusion, cut toughness, tear strain, grasp damage and friction.
void takeTissue(const material::Tissue& tissue, material::Condition condition, Object& object);

/// A number of an object that is another one than its tissue's.
struct Override {
  std::string quantity;  ///< key of the database
  double value = 0.0, of_tissue = 0.0;
  std::string unit;  ///< as the database writes it
};
/// Those of an object that names a tissue, in vivo. Elements of several materials have several laws: theirs
/// are not compared. Numbers of a scene file have ten digits, and so many are.
std::vector<Override> overridesOf(const Object& object, const material::Tissue& tissue);

}  // namespace vest::scene

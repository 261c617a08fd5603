#include "vest_tissue/scene/tissue_numbers.h"

#include <cmath>

#include "vest_tissue/fem/description.h"

namespace vest::scene {
namespace {

/// What the database alone says, by its key.
template <class AnyObject, class Visit>
void eachNumber(AnyObject& object, Visit visit) {
  visit("heat_capacity", object.thermal.heat_capacity);
  visit("thermal_conductivity", object.thermal.conductivity);
  visit("perfusion", object.thermal.perfusion);
  visit("cut_toughness", object.cut_toughness);
  visit("tear_strain", object.tear_strain);
  visit("grasp_damage", object.grasp_damage_threshold);
  visit("friction", object.friction);
}

}  // namespace

void takeTissue(const material::Tissue& tissue, material::Condition condition, Object& object) {
  eachNumber(object, [&](const char* key, double& number) { number = tissue.at(key, condition).value; });
}

std::vector<Override> overridesOf(const Object& object, const material::Tissue& tissue) {
  constexpr double kDigits = 1e-9;
  std::vector<Override> overrides;
  const auto compare = [&](const char* key, double value) {
    const material::Quantity& of = tissue.at(key);
    if (std::fabs(value - of.value) > kDigits * std::fabs(of.value))
      overrides.push_back({key, value, of.value, of.unit});
  };
  if (object.model == ObjectModel::Rigid) {  // nothing cuts, tears or pinches it
    compare("friction", object.friction);
    return overrides;
  }
  if (!object.fem || object.fem->materials.empty()) {
    const fem::Material* const m = object.fem ? &object.fem->material : nullptr;
    compare("youngs_modulus", m ? m->youngs_modulus : object.law.youngs_modulus);
    compare("density", m ? m->density : object.density);
    if (m) compare("poisson_ratio", m->poisson_ratio);
  }
  if (!object.fem) {
    compare("a2", object.law.a2);
    compare("a3", object.law.a3);
    compare("a4", object.law.a4);
    compare("max_strain", object.law.max_strain);
  }
  eachNumber(object, compare);
  return overrides;
}

}  // namespace vest::scene

#include "vest_tissue/scene/edits.h"

#include <algorithm>
#include <cstdio>

#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::scene {
namespace {

std::string inWords(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

void list(std::string* to, const std::string& word) {
  if (("," + *to + ",").find(", " + word + ",") != std::string::npos || *to == word ||
      to->rfind(word + ",", 0) == 0)
    return;
  *to += (to->empty() ? "" : ", ") + word;
}

}  // namespace

void editableParameters(const World& world, std::vector<EditableParameter>& out) {
  for (const WorldParameter& p : kWorldParameters)
    out.push_back({"", std::string(p.name), std::string(p.unit), p.low, p.high});
  for (const std::size_t i : world.model().bodies) {
    const ObjectConstants& object = world.model().objects[i];
    const std::string& name = world.description().objects[i].name;
    const double law = object.law.youngs_modulus;
    if (law > 0) out.push_back({name, "youngs_modulus", "Pa", kLeastScale * law, kGreatestScale * law});
    out.push_back({name, "damping_scale", "", kLeastScale, kGreatestScale});
  }
}

std::string refusal(const std::vector<EditableParameter>& allowed, const ParameterEdit& edit) {
  std::string objects, parameters;
  bool world = false;
  for (const EditableParameter& p : allowed) {
    if (p.object.empty()) world = true;
    if (p.object != edit.object) {
      if (!p.object.empty()) list(&objects, p.object);
      continue;
    }
    if (p.parameter != edit.parameter) {
      list(&parameters, p.parameter);
      continue;
    }
    if (edit.value >= p.low && edit.value <= p.high) return {};
    return (edit.object.empty() ? "" : edit.object + ": ") + edit.parameter + " = " + inWords(edit.value) +
           ": allowed is " + inWords(p.low) + " to " + inWords(p.high) + (p.unit.empty() ? "" : " " + p.unit);
  }
  if (!parameters.empty())
    return (edit.object.empty() ? "" : edit.object + ": ") + "parameter = " + edit.parameter +
           ": allowed is one of " + parameters;
  return "object = " + edit.object + ": allowed is one of " + objects +
         (world ? ", or none for what belongs to no object" : "");
}

}  // namespace vest::scene

#pragma once

#include <map>
#include <string>
#include <vector>

#include "vest_tissue/material/database.h"

namespace vest::material {

/// What a thread is made of. Keys: density, youngs_modulus, poisson_ratio, bending_ratio (EI of the thread
/// over that of a solid round rod; of twisting the same), friction_slack and friction_tight (Coulomb, on
/// itself, without load and under great load), friction_pressure (Pa, half-way between them).
struct SutureMaterial {
  std::string name;
  bool absorbable = false;
  std::map<std::string, Quantity> numbers;
};

/// A size as the United States Pharmacopeia names it. Keys: diameter, knot_pull (least, not absorbable),
/// knot_pull_absorbable (least, synthetic), swage (needle's attachment, least average).
struct SutureSize {
  std::string name;
  std::map<std::string, Quantity> numbers;
};

struct Sutures {
  std::string file;
  std::vector<SutureMaterial> materials;
  std::vector<SutureSize> sizes;
};

/// Reads data/sutures.yaml, strictly. @throws std::invalid_argument: file, line, field, value, what is
/// allowed
Sutures readSutures(const std::string& path);

/// The shipped file, beside databasePath().
std::string suturesPath();

}  // namespace vest::material

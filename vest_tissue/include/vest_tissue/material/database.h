#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "vest_tissue/material/law.h"

namespace vest::material {

/// One number of the database, with where it is from.
struct Quantity {
  double value = 0.0;
  std::string unit;
  bool assumed = false;
  std::string source;  ///< citation with DOI or equal; for assumed ones: why
  std::string place, quoted,
      strain;  ///< table or figure; what stands there; range or condition. Empty: assumed
};

enum class Condition : std::uint8_t { InVivo = 0, PostMortem = 1 };

/// A tissue. Keys: youngs_modulus, poisson_ratio, a2, a3, a4, max_strain, density, speed_of_sound, viscosity,
/// cut_toughness, tear_strain, grasp_damage, friction, perfusion, thermal_conductivity, heat_capacity (units:
/// the file's `units`).
struct Tissue {
  std::string name;
  std::map<std::string, Quantity> in_vivo;
  std::map<std::string, Quantity> post_mortem;  ///< what differs
  std::string others;                           ///< what post_mortem says of the rest

  /// The number that holds in a condition. @throws std::invalid_argument naming tissue and key
  const Quantity& at(const std::string& key, Condition condition = Condition::InVivo) const;
  Law law(Condition condition = Condition::InVivo) const;
};

struct Database {
  std::string file;
  std::vector<Tissue> tissues;  ///< in the file's order
  /// @throws std::invalid_argument: file, name, what there is
  const Tissue& at(const std::string& name) const;
};

/// Reads data/materials.yaml, strictly. @throws std::invalid_argument: file, line, field, value, what is
/// allowed
Database readDatabase(const std::string& path);

/// The shipped database: $VEST_TISSUE_DATA/materials.yaml if that variable is set, else of the source tree,
/// else of the install space.
std::string databasePath();

/// One measured point of a bar: engineering strain and stress.
struct Point {
  double strain = 0.0;  ///< no unit
  double stress = 0.0;  ///< Pa
};

/// Least squares fit of the law (material/law.h): sigma = E·eps + (E·a2)·eps² + … for eps > 0, E·eps for eps
/// <= 0; linear in E, E·a2, E·a3, E·a4.
struct Fit {
  Law law;                     ///< max_strain: the greatest strain of the data
  int terms = 4;               ///< coefficients that were fitted, the others are 0
  double rms = 0.0;            ///< Pa, root of the mean square residual
  double greatest = 0.0;       ///< Pa, greatest residual
  double determination = 0.0;  ///< R², no unit
  double least_strain = 0.0, greatest_strain = 0.0;
  bool monotone = true;  ///< false: the law falls somewhere; the simulation refuses it
};
/// @param terms 1 … 4: E alone … with a4
/// @throws std::invalid_argument if the points cannot fix that many coefficients, or E comes out <= 0
Fit fitLaw(const std::vector<Point>& points, int terms = 4);

/// Reads a curve: CSV with columns strain (no unit) and stress (Pa). @throws std::invalid_argument: file,
/// line, field, value, what is allowed
std::vector<Point> readCurve(const std::string& path);

}  // namespace vest::material

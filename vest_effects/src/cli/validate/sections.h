#pragma once

#include <string>

#include "vest_tissue/validation/section.h"

/// The sections of docs/validation.md that vest_effects makes. Data that does not belong to the repository is
/// used where it lies: an empty path leaves out what needs it.
namespace vest::validate {

struct Options {
  std::string data;     ///< folder with cca, uta and adan56, or empty
  double minutes = 5;   ///< of the volume balance
  std::string shipped;  ///< vest_effects/data/haemodynamics
};

/// Published curves; needs the data.
validation::Section curvesSection(const Options& options, const std::string& command);
/// Networks: grids and mass balance.
validation::Section networksSection(const Options& options, const std::string& command);
/// Bleeding times, haemostasis by pressure, recovery of tissue without blood.
validation::Section haemostasisSection(const Options& options, const std::string& command);
validation::Section jetsSection(const Options& options, const std::string& command);
validation::Section restSection(const Options& options, const std::string& command);
validation::Section balanceSection(const Options& options, const std::string& command);

}  // namespace vest::validate

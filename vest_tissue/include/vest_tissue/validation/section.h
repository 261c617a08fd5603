#pragma once

#include <string>
#include <utility>
#include <vector>

#include "vest_tissue/validation/svg_plot.h"

/// docs/validation.md is made of sections, one file each: docs/validation/NN_NAME.md with its plots beside
/// it, NN_NAME_PLOT.svg. The number gives the order: 1x materials and nets, 2x finite elements, 3x
/// interactions, 4x heat, 5x blood, 6x fluids, 7x haptics. Every package writes its own with this class (or
/// any other way); assemble() joins all that lie there, whoever made them.
namespace vest::validation {

/// One thing that the section claims, with the bound that it is judged by.
struct Check {
  std::string what;
  double value = 0.0;
  double bound = 0.0;
  bool at_least = false;  ///< value >= bound passes; else value <= bound
  std::string unit;       ///< "%", "m", "no unit"
  /// False for NaN, whatever the bound.
  bool passed() const { return at_least ? value >= bound : value <= bound; }
};

class Section {
 public:
  /// @param stem "10_materials": two digits, then letters, digits, underscores
  /// @param command what makes this section, as a user would type it
  /// @throws std::invalid_argument on another stem
  Section(std::string stem, std::string title, std::string command);

  void text(const std::string& paragraph);
  void table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  /// Puts the plot here; written to STEM_NAME.svg.
  void plot(const std::string& name, const Plot& plot);
  /// A claim: kept for the table at the section's end. Returns whether it holds.
  bool atMost(const std::string& what, double value, double bound, const std::string& unit);
  bool atLeast(const std::string& what, double value, double bound, const std::string& unit);

  const std::string& stem() const { return stem_; }
  const std::vector<Check>& checks() const { return checks_; }
  bool passed() const;
  /// Names, values and bounds of the checks that fail, a line each; empty if all hold.
  std::string failures() const;
  std::string markdown() const;
  /// STEM.md and its plots into a folder that is made if need be. @throws std::runtime_error
  void write(const std::string& directory) const;

 private:
  void claim(Check check);
  std::string stem_, title_, command_, body_;
  std::vector<Check> checks_;
  std::vector<std::pair<std::string, std::string>> files_;  ///< plots: name, SVG
};

/// A number with four significant digits.
std::string digits(double value);

/// Joins DIRECTORY/NN_*.md, by name, to one page with links to the plots as seen from the page's folder.
/// @param page its path; DIRECTORY has to lie in its folder
/// @returns the number of sections. @throws std::runtime_error
std::size_t assemble(const std::string& directory, const std::string& page);

}  // namespace vest::validation

#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vest_tissue/validation/section.h"

/// The sections of docs/validation.md that vest_tissue makes. Each is one function in one file of this
/// folder; add yours to sections(). Each is also a test (test/validation/), so keep `full == false` within
/// seconds.
namespace vest::validate {

struct Options {
  bool full = false;  ///< finer meshes and longer runs
};

/// @param command what the section says that made it
validation::Section materialsSection(const Options& options, const std::string& command);
validation::Section barsSection(const Options& options, const std::string& command);
validation::Section forcesSection(const Options& options, const std::string& command);
validation::Section conservationSection(const Options& options, const std::string& command);
validation::Section stiffnessSection(const Options& options, const std::string& command);
validation::Section finiteElementsSection(const Options& options, const std::string& command);
validation::Section threadsSection(const Options& options, const std::string& command);
validation::Section threadMotionSection(const Options& options, const std::string& command);
validation::Section knotsSection(const Options& options, const std::string& command);

struct Entry {
  std::string name;  ///< what the command line calls it
  std::function<validation::Section(const Options&, const std::string&)> make;
};
inline std::vector<Entry> sections() {
  return {{"materials", materialsSection}, {"bars", barsSection},
          {"forces", forcesSection},       {"conservation", conservationSection},
          {"stiffness", stiffnessSection}, {"finite_elements", finiteElementsSection},
          {"threads", threadsSection},     {"thread_motion", threadMotionSection},
          {"knots", knotsSection}};
}

}  // namespace vest::validate

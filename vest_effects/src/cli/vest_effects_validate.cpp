// Sections of docs/validation.md: pulse waves and fluids.

#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <vector>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "validate/sections.h"
#include "vest_instruments/files/option.h"

int main(int argc, char** argv) {
  using vest::validation::Section;
  namespace validate = vest::validate;
  CLI::App app{
      "Writes the validation of vest_effects: sections into a folder, and the page made of all sections "
      "there"};
  validate::Options options;
  std::string output = "docs/validation";
  std::vector<std::string> only;
  const std::vector<
      std::pair<std::string, std::function<Section(const validate::Options&, const std::string&)>>>
      all{{"curves", validate::curvesSection},
          {"networks", validate::networksSection},
          {"haemostasis", validate::haemostasisSection},
          {"jets", validate::jetsSection},
          {"rest", validate::restSection},
          {"balance", validate::balanceSection}};
  std::string known;
  for (const auto& [name, make] : all) known += (known.empty() ? "" : ", ") + name;
  app.add_option("--data", options.data, "folder with the published cases cca, uta and adan56")
      ->check(CLI::ExistingDirectory);
  app.add_option("--minutes", options.minutes, "of irrigation with suction")
      ->check(vest::files::number(0.1, 60));
  app.add_option("--output", output, "folder of the sections; the page is FOLDER.md")->capture_default_str();
  app.add_option("SECTION", only, "only these (default: all): " + known);
  CLI11_PARSE(app, argc, argv);
  try {
    options.shipped = ros::package::getPath("vest_effects") + "/data/haemodynamics";
    while (output.size() > 1 && output.back() == '/') output.pop_back();
    bool good = true;
    std::size_t made = 0;
    for (const auto& [name, make] : all) {
      bool wanted = only.empty() && !(name == "curves" && options.data.empty());
      for (const auto& one : only) wanted = wanted || one == name;
      if (!wanted) continue;
      const Section section = make(options, "rosrun vest_effects vest_effects_validate --data FOLDER");
      section.write(output);
      std::printf("%-10s %zu claims, %s\n", name.c_str(), section.checks().size(),
                  section.passed() ? "all hold" : "NOT all hold");
      std::fflush(stdout);
      std::fprintf(stderr, "%s", section.failures().c_str());
      good = good && section.passed();
      ++made;
    }
    if (made == 0) throw std::invalid_argument("SECTION: " + only.front() + " (allowed: " + known + ")");
    std::printf("%s.md: %zu sections\n", output.c_str(), vest::validation::assemble(output, output + ".md"));
    return good ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_effects_validate: %s\n", error.what());
    return 2;
  }
}

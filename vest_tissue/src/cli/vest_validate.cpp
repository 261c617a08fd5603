#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "validate/sections.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Writes the validation of vest_tissue: sections into a folder, and the page made of all sections "
      "there.");
  std::string output = "docs/validation";
  std::vector<std::string> only;
  vest::validate::Options options;
  std::string known;
  for (const auto& entry : vest::validate::sections()) known += (known.empty() ? "" : ", ") + entry.name;
  app.add_option("--output", output, "folder of the sections; the page is FOLDER.md")->capture_default_str();
  app.add_flag("--full", options.full, "finer meshes");
  app.add_option("SECTION", only, "only these (default: all): " + known);
  CLI11_PARSE(app, argc, argv);
  try {
    while (output.size() > 1 && output.back() == '/') output.pop_back();
    bool good = true;
    std::size_t made = 0;
    for (const auto& entry : vest::validate::sections()) {
      bool wanted = only.empty();
      for (const auto& name : only) wanted = wanted || name == entry.name;
      if (!wanted) continue;
      const auto section = entry.make(
          options, "rosrun vest_tissue vest_validate" + std::string(options.full ? " --full" : ""));
      section.write(output);
      std::printf("%-18s %zu claims, %s\n", entry.name.c_str(), section.checks().size(),
                  section.passed() ? "all hold" : "NOT all hold");
      std::fflush(stdout);
      std::fprintf(stderr, "%s", section.failures().c_str());
      good = good && section.passed();
      ++made;
    }
    if (made == 0) throw std::invalid_argument("SECTION: " + only.front() + " (allowed: " + known + ")");
    const std::size_t sections = vest::validation::assemble(output, output + ".md");
    std::printf("%s.md: %zu sections\n", output.c_str(), sections);
    return good ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_validate: %s\n", error.what());
    return 2;
  }
}

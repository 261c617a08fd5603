#include "library_commands.h"

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/modelling/fields.h"

namespace vest::tools {

using modelling::LibraryEntry;

namespace {

std::string shown(const std::string& text) {
  return files::shown(text, 4000);
}

void printObjects(const std::string& file) {
  const modelling::Document document(scene::yaml::readFile(file, scene::yaml::kMaxBytes));
  std::printf("%-24s %-18s %-14s %s\n", "object", "kind", "organ", "material");
  for (const modelling::ObjectLine& line : modelling::objectsOf(document))
    std::printf("%-24s %-18s %-14s %s\n", shown(line.name).c_str(), shown(line.kind).c_str(),
                shown(line.organ).c_str(), shown(line.material).c_str());
}

}  // namespace

void printLibrary(const std::vector<LibraryEntry>& entries, const std::string& kind) {
  std::printf("%-9s %-18s %-13s %s\n", "kind", "name", "licence", "what; from");
  for (const LibraryEntry& entry : entries)
    if (kind.empty() || entry.kind == kind)
      std::printf("%-9s %-18s %-13s %s; %s\n", entry.kind.c_str(), entry.name.c_str(),
                  shown(entry.licence).c_str(), shown(entry.about).c_str(), shown(entry.source).c_str());
}

void printEntry(const LibraryEntry& entry) {
  std::printf("%s %s\n  what     %s\n  from     %s\n  licence  %s\n  file     %s\n", entry.kind.c_str(),
              entry.name.c_str(), shown(entry.about).c_str(), shown(entry.source).c_str(),
              shown(entry.licence).c_str(), entry.file.empty() ? "none" : entry.file.c_str());
  if (!entry.picture.empty()) std::printf("  picture  %s\n", entry.picture.c_str());
  if (entry.kind == "part") printObjects(entry.file);
  if (entry.kind == "scene") {
    const auto source = std::filesystem::path(entry.file).parent_path() / "source.yaml";
    if (std::filesystem::exists(source)) printObjects(source.string());
  }
  if (entry.kind == "material")
    std::printf("every number: rosrun vest_tissue vest_material show %s\n", entry.name.c_str());
}

bool checkLibrary(const std::vector<LibraryEntry>& entries) {
  const std::vector<std::string> faults = modelling::faultsOf(entries);
  for (const std::string& fault : faults) std::printf("%s\n", shown(fault).c_str());
  std::printf("%zu entries, %zu with a fault\n", entries.size(), faults.size());
  return faults.empty();
}

std::string addPart(const std::string& source, const LibraryEntry& entry, const std::string& as,
                    const std::vector<double>& by, const std::string& directory,
                    const modelling::Materials& materials) {
  modelling::Session session(source, scene::yaml::readFile(source, scene::yaml::kMaxBytes), materials);
  const modelling::Vector3 shift =
      by.size() == 3 ? modelling::Vector3(by[0], by[1], by[2]) : modelling::Vector3(0, 0, 0);
  for (const auto& line : modelling::additions(session.document(), entry.file, as, shift))
    session.apply(line.op, line.path, line.value);
  std::printf("%s: %s added, document %s\n", shown(source).c_str(), entry.name.c_str(),
              session.hash().c_str());
  return modelling::save(session, directory);
}

}  // namespace vest::tools

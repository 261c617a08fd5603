#include "edit_source.h"

#include <cstdio>
#include <filesystem>

#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"

namespace vest::tools {

std::string editSource(const std::string& source, const std::string& script, const std::string& directory,
                       const modelling::Materials& materials) {
  constexpr std::size_t kMost = scene::yaml::kMaxBytes;
  modelling::Session session(source, scene::yaml::readFile(source, kMost), materials);
  modelling::play(modelling::readEdits(script, scene::yaml::readFile(script, kMost)), session);
  std::printf("%s: %zu edits, document %s\n", files::shown(source, 6000).c_str(), session.log().size() - 1,
              session.hash().c_str());
  return modelling::save(session, directory);
}

void printProposals(const std::string& source, const std::string& object, double within,
                    const modelling::Materials& materials) {
  const modelling::Session session(source, scene::yaml::readFile(source, scene::yaml::kMaxBytes), materials);
  const auto proposals = session.propose(object, within);
  std::printf("vest_edits: 1\nsource_hash: \"%s\"\n", session.hash().c_str());
  std::printf(proposals.empty() ? "edits: []\n" : "edits:\n");
  std::string first;
  for (const auto& p : proposals) {
    // The first of them makes the list that the others are added to.
    const bool makes = p.path.back() != '-' && first.empty();
    const bool alone = p.path.back() != '-';
    if (makes) first = p.path;
    const std::string value = alone && !makes ? p.value.substr(1, p.value.size() - 2) : p.value;
    std::printf("  # rings %d to %d of %s: %.2f to %.2f mm from %s\n", p.first, p.last, p.object.c_str(),
                1e3 * p.nearest, 1e3 * p.farthest, p.to.c_str());
    std::printf("  - {op: %s, path: %s, value: %s}\n", makes ? "set" : "insert",
                (alone && !makes ? p.path + "/-" : p.path).c_str(), value.c_str());
  }
}

}  // namespace vest::tools

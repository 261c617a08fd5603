#include "vest_tissue/material/sutures.h"

#include <set>

#include "quantity.h"

namespace vest::material {
namespace {

using scene::yaml::Map;
using scene::yaml::Value;

const Ranges kMaterial{{"density", {1, 20000}},         {"youngs_modulus", {1e3, 1e12}},
                       {"poisson_ratio", {0, 0.5}},     {"bending_ratio", {1e-6, 1}},
                       {"friction_slack", {0, 1000}},   {"friction_tight", {0, 1000}},
                       {"friction_pressure", {1, 1e12}}};
const Ranges kSize{{"diameter", {1e-6, 0.01}},
                   {"knot_pull", {1e-6, 1e5}},
                   {"knot_pull_absorbable", {1e-6, 1e5}},
                   {"swage", {1e-6, 1e5}}};

/// Entries of one list, each with a name that is there once and all numbers of its kind.
template <class Entry, class Rest>
std::vector<Entry> readList(const Value& list, const Ranges& ranges, const Words& units, const Words& sources,
                            Rest rest) {
  std::vector<Entry> entries;
  std::set<std::string> names;
  for (const Value& item : list.list()) {
    Map map(item);
    Entry entry;
    entry.name = map["name"].name();
    if (!names.insert(entry.name).second) map["name"].fail("must be there once");
    for (const auto& [key, range] : ranges)
      entry.numbers[key] = readQuantity(map[key], range, units.at(key), sources);
    rest(map, entry);
    map.finish();
    entries.push_back(std::move(entry));
  }
  if (entries.empty()) list.fail("must have at least one entry");
  return entries;
}

}  // namespace

Sutures readSutures(const std::string& path) {
  const Value root = scene::yaml::parse(path, scene::yaml::readFile(path, scene::yaml::kMaxBytes));
  Map map(root);
  map["vest_sutures"].integer(1, 1);
  Ranges all = kMaterial;
  all.insert(kSize.begin(), kSize.end());
  const Words units = readUnits(map["units"], all), sources = readSources(map["sources"]);
  Sutures s;
  s.file = path;
  s.materials =
      readList<SutureMaterial>(map["materials"], kMaterial, units, sources, [](Map& m, SutureMaterial& e) {
        e.absorbable = m["absorbable"].boolean();
        if (e.numbers.at("friction_tight").value > e.numbers.at("friction_slack").value)
          m["friction_tight"].fail("must be at most friction_slack");
      });
  s.sizes = readList<SutureSize>(map["sizes"], kSize, units, sources, [](Map&, SutureSize&) {});
  map.finish();
  return s;
}

std::string suturesPath() {
  const std::string beside = databasePath();
  return beside.substr(0, beside.find_last_of('/') + 1) + "sutures.yaml";
}

}  // namespace vest::material

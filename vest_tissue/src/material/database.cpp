#include "vest_tissue/material/database.h"

#include <cstdlib>
#include <fstream>
#include <set>
#include <stdexcept>

#include "quantity.h"

namespace vest::material {
namespace {

using scene::yaml::Map;
using scene::yaml::Value;

const Ranges kRanges{{"youngs_modulus", {1, 1e12}},
                     {"poisson_ratio", {0, 0.4999}},
                     {"a2", {-1e3, 1e3}},
                     {"a3", {-1e3, 1e3}},
                     {"a4", {-1e3, 1e3}},
                     {"max_strain", {1e-3, 2}},
                     {"density", {1, 20000}},
                     {"speed_of_sound", {100, 10000}},
                     {"viscosity", {0, 1e6}},
                     {"cut_toughness", {0.1, 1e7}},
                     {"tear_strain", {1e-3, 100}},
                     {"grasp_damage", {1, 1e10}},
                     {"friction", {0, 2}},
                     {"perfusion", {0, 1}},
                     {"thermal_conductivity", {0.001, 1000}},
                     {"heat_capacity", {1, 1e5}}};

}  // namespace

std::string words(const Value& value, std::size_t least) {
  const std::string text = value.string();
  if (text.size() < least) value.fail("must say more than that");
  return text;
}

Words readUnits(const Value& value, const Ranges& ranges) {
  Map map(value);
  Words units;
  for (const auto& [key, range] : ranges) {
    (void)range;
    units[key] = map[key].string();
  }
  map.finish();
  return units;
}

Words readSources(const Value& value) {
  const Map each_key_once(value);
  Words sources;
  for (const auto& item : value.node()) {  // looked up by key, each would be looked for among all
    const std::string& key = item.first.Scalar();
    sources[key] = words(Value(value.file(), value.field() + "." + key, item.second), 12);
  }
  return sources;
}

Quantity readQuantity(const Value& value, const std::pair<double, double>& range, const std::string& unit,
                      const Words& sources) {
  Map map(value);
  Quantity q;
  q.value = map["value"].number(range.first, range.second);
  q.unit = unit;
  if (map.has("assumed")) {
    if (!map["assumed"].boolean()) map["assumed"].fail("must be true, or not be there");
    q.assumed = true;
    q.source = words(map["why"], 5);
  } else {
    const Value source = map["source"];
    const auto found = sources.find(source.name());
    if (found == sources.end()) source.fail("must be a key of sources");
    q.source = found->second;
    q.place = words(map["place"], 3);
    q.quoted = words(map["quoted"], 3);
    q.strain = words(map["strain"], 1);
  }
  map.finish();
  return q;
}

const Quantity& Tissue::at(const std::string& key, Condition condition) const {
  if (condition == Condition::PostMortem) {
    const auto found = post_mortem.find(key);
    if (found != post_mortem.end()) return found->second;
  }
  const auto found = in_vivo.find(key);
  if (found == in_vivo.end())
    throw std::invalid_argument("material '" + name + "': no quantity '" + key + "'");
  return found->second;
}

Law Tissue::law(Condition c) const {
  return {at("youngs_modulus", c).value, at("a2", c).value, at("a3", c).value, at("a4", c).value,
          at("max_strain", c).value};
}

const Tissue& Database::at(const std::string& name) const {
  std::string known;
  for (const Tissue& t : tissues) {
    if (t.name == name) return t;
    known += (known.empty() ? "" : ", ") + t.name;
  }
  throw std::invalid_argument(file + ": material '" + name + "' is not in the database (allowed: " + known +
                              ")");
}

Database readDatabase(const std::string& path) {
  const Value root = scene::yaml::parse(path, scene::yaml::readFile(path, scene::yaml::kMaxBytes));
  Map map(root);
  map["vest_materials"].integer(3, 3);
  const Words units = readUnits(map["units"], kRanges), sources = readSources(map["sources"]);
  Database database;
  database.file = path;
  std::set<std::string> names;
  for (const Value& item : map["materials"].list()) {
    Map entry(item);
    Tissue tissue;
    tissue.name = entry["name"].name();
    if (!names.insert(tissue.name).second) entry["name"].fail("must be there once");
    Map living(entry["in_vivo"]), dead(entry["post_mortem"]);
    for (const auto& [key, unit] : units) {
      tissue.in_vivo[key] = readQuantity(living[key], kRanges.at(key), unit, sources);
      if (dead.has(key)) tissue.post_mortem[key] = readQuantity(dead[key], kRanges.at(key), unit, sources);
    }
    tissue.others = words(dead["others"], 10);
    living.finish();
    dead.finish();
    entry.finish();
    for (const Condition c : {Condition::InVivo, Condition::PostMortem})
      if (!isMonotone(tissue.law(c))) entry["name"].fail("must have a law that rises up to max_strain");
    database.tissues.push_back(std::move(tissue));
  }
  map.finish();
  return database;
}

std::string databasePath() {
  const auto in = [](const std::string& folder) { return folder + "/materials.yaml"; };
  if (const char* own = std::getenv("VEST_TISSUE_DATA")) return in(own);
  const std::string source = in(VEST_TISSUE_SOURCE_DATA);
  return std::ifstream(source).good() ? source : in(VEST_TISSUE_INSTALLED_DATA);
}

}  // namespace vest::material

#include <yaml-cpp/yaml.h>
#include <algorithm>

#include <set>

#include "vest_effects/haemodynamics/vessels.h"
#include "vest_instruments/files/strict_yaml.h"

namespace vest::haemodynamics {

namespace {

constexpr std::size_t kMostBytes = 1u << 20;
constexpr int kMostDepth = 8;

class Reader {
 public:
  Reader(std::string file, Vessels& out) : file_(std::move(file)), out_(out) {}

  [[noreturn]] void fail(const YAML::Node& node, const std::string& field, const std::string& allowed) const {
    std::string value = node.IsDefined() && node.IsScalar() ? node.Scalar() : "(not a single value)";
    if (!node.IsDefined()) value = "(missing)";
    throw NetworkError(file_, node.IsDefined() ? node.Mark().line + 1 : 0, field, value, allowed);
  }

  /// All keys of a mapping are known, and none stands twice.
  void only(const YAML::Node& map, const std::string& field, const std::set<std::string>& keys) const {
    if (!map.IsDefined() || !map.IsMap()) fail(map, field, "a mapping");
    std::set<std::string> seen;
    for (const auto& entry : map) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (keys.count(key) == 0) fail(entry.first, field + (field.empty() ? "" : ".") + key, "a known key");
      if (!seen.insert(key).second) fail(entry.first, field + "." + key, "each key once");
    }
  }
  std::string text(const YAML::Node& node, const std::string& field) const {
    if (!node.IsDefined() || !node.IsScalar() || node.Scalar().empty()) fail(node, field, "a text");
    return node.Scalar();
  }
  double number(const YAML::Node& node, const std::string& field, double least, double most) const {
    double value = 0;
    if (!node.IsDefined() || !node.IsScalar() || !parseNumber(node.Scalar(), value) ||
        !(value >= least && value <= most))
      fail(node, field, formatNumber(least) + " ... " + formatNumber(most));
    return value;
  }
  void source(const YAML::Node& node, const std::string& field, const std::string& of) const {
    const std::string key = text(node, field);
    if (out_.sources.count(key) == 0) fail(node, field, "a key of `sources`");
    out_.source_of[of] = key;
  }

  void read(const YAML::Node& root) {
    only(root, "",
         {"vest_vessels", "sources", "quoted", "reference_artery", "numbers", "veins", "territories"});
    number(root["vest_vessels"], "vest_vessels", 1, 1);
    const YAML::Node sources = root["sources"];
    if (!sources.IsDefined() || !sources.IsMap()) fail(sources, "sources", "a mapping of key to citation");
    for (const auto& entry : sources) {
      const std::string key = text(entry.first, "sources");
      if (!out_.sources.emplace(key, text(entry.second, "sources." + key)).second)
        fail(entry.first, "sources." + key, "each key once");
    }
    out_.reference_artery = text(root["reference_artery"], "reference_artery");
    bool found = false;
    for (const auto& s : out_.network.segments) found = found || s.name == out_.reference_artery;
    if (!found) fail(root["reference_artery"], "reference_artery", "the name of a segment of network.csv");
    readNumbers(root["numbers"]);
    readQuoted(root["quoted"]);
    readVeins(root["veins"]);
    readTerritories(root["territories"]);
  }

 private:
  void readNumbers(const YAML::Node& node) {
    struct Field {
      const char* name;
      const char* unit;
      double least, most;
      double* to;
    };
    ControlNumbers& c = out_.control;
    const std::vector<Field> fields = {
        {"blood_volume", "m3", 5e-4, 2e-2, &c.blood_volume},
        {"filling_pressure", "Pa", 100, 5000, &c.filling_pressure},
        {"systemic_compliance", "m3/Pa", 1e-8, 1e-4, &c.systemic_compliance},
        {"leg_compliance", "m3/Pa", 0, 1e-5, &c.leg_compliance},
        {"atrial_pressure", "Pa", -1000, 3000, &c.atrial_pressure},
        {"heart_rate", "Hz", 0.3, 4, &c.heart_rate},
        {"reflex_rate_gain", "1", 0, 3, &c.rate_gain},
        {"reflex_resistance_gain", "1", 0, 5, &c.resistance_gain},
        {"reflex_volume", "m3", 0, 5e-3, &c.reflex_volume},
        {"reflex_relaxation", "1", 0, 1, &c.reflex_relaxation},
        {"reflex_width", "Pa", 100, 1e5, &c.reflex_width},
        {"reflex_resistance_width", "Pa", 100, 1e5, &c.resistance_width},
        {"ischaemic_pressure", "Pa", 0, 2e4, &c.ischaemic_pressure},
        {"reflex_rate_time", "s", 0.1, 1000, &c.rate_time},
        {"reflex_resistance_time", "s", 0.1, 1000, &c.resistance_time},
        {"reflex_volume_time", "s", 0.1, 1000, &c.volume_time},
        {"baroreceptor_time", "s", 0.1, 100, &c.baroreceptor_time},
        {"discharge", "1", 0, 1, &c.discharge},
        {"gas_resistance_gain", "1", 0, 5, &c.gas_resistance_gain},
        {"gas_resistance_pressure", "Pa", 100, 1e5, &c.gas_resistance_pressure},
    };
    std::set<std::string> names;
    for (const Field& f : fields) names.insert(f.name);
    only(node, "numbers", names);
    for (const Field& f : fields) {
      const std::string field = std::string("numbers.") + f.name;
      const YAML::Node entry = node[f.name];
      only(entry, field, {"value", "unit", "source"});
      *f.to = number(entry["value"], field + ".value", f.least, f.most);
      if (text(entry["unit"], field + ".unit") != f.unit) fail(entry["unit"], field + ".unit", f.unit);
      source(entry["source"], field + ".source", f.name);
    }
    if (!(c.filling_pressure > c.atrial_pressure))
      fail(node["filling_pressure"]["value"], "numbers.filling_pressure.value", "> atrial_pressure");
  }

  void readQuoted(const YAML::Node& list) {
    if (!list.IsDefined()) return;
    if (!list.IsSequence()) fail(list, "quoted", "a list");
    for (const auto& entry : list) {
      only(entry, "quoted", {"vessel", "flow_m3_s", "radius_m", "velocity_m_s", "source"});
      QuotedVessel q;
      q.vessel = text(entry["vessel"], "quoted.vessel");
      q.flow = number(entry["flow_m3_s"], "quoted.flow_m3_s", 0, 1);
      q.radius = number(entry["radius_m"], "quoted.radius_m", 0, 1);
      q.velocity = number(entry["velocity_m_s"], "quoted.velocity_m_s", 0, 100);
      source(entry["source"], "quoted.source", "quoted." + q.vessel);
      q.source = out_.source_of["quoted." + q.vessel];
      out_.quoted.push_back(q);
    }
  }

  void readVeins(const YAML::Node& list) {
    if (!list.IsDefined()) return;
    if (!list.IsSequence()) fail(list, "veins", "a list");
    std::set<std::string> names;
    for (const auto& s : out_.network.segments) names.insert(s.name);
    for (const auto& entry : list) {
      only(entry, "veins",
           {"name", "length_m", "radius_m", "pressure_Pa", "upstream_Pa", "central_Pa", "flow_m3_s",
            "source"});
      Vein v;
      v.name = text(entry["name"], "veins.name");
      if (!names.insert(v.name).second) fail(entry["name"], "veins.name", "a name of its own");
      v.length = number(entry["length_m"], "veins.length_m", 1e-3, 2);
      v.radius = number(entry["radius_m"], "veins.radius_m", 1e-5, 0.05);
      v.pressure = number(entry["pressure_Pa"], "veins.pressure_Pa", 1, 1e4);
      v.upstream_pressure = number(entry["upstream_Pa"], "veins.upstream_Pa", 1, 1e4);
      v.central_pressure = number(entry["central_Pa"], "veins.central_Pa", -1000, 1e4);
      v.flow = number(entry["flow_m3_s"], "veins.flow_m3_s", 1e-12, 1e-3);
      if (!(v.upstream_pressure > v.pressure))
        fail(entry["upstream_Pa"], "veins.upstream_Pa", "> pressure_Pa");
      if (!(v.central_pressure < v.pressure)) fail(entry["central_Pa"], "veins.central_Pa", "< pressure_Pa");
      source(entry["source"], "veins.source", v.name);
      out_.veins.push_back(v);
    }
  }

  void readTerritories(const YAML::Node& list) {
    if (!list.IsDefined()) return;
    if (!list.IsSequence()) fail(list, "territories", "a list");
    std::set<std::string> names;
    for (const auto& entry : list) {
      only(entry, "territories", {"tissue", "fed_by", "drained_by", "source"});
      Territory t;
      t.tissue = text(entry["tissue"], "territories.tissue");
      if (!names.insert(t.tissue).second) fail(entry["tissue"], "territories.tissue", "a name of its own");
      if (!entry["fed_by"].IsDefined() || !entry["fed_by"].IsSequence() || entry["fed_by"].size() == 0)
        fail(entry["fed_by"], "territories.fed_by", "a list of segments");
      for (const auto& name : entry["fed_by"]) {
        int found = -1;
        for (std::size_t i = 0; i < out_.network.segments.size(); ++i)
          if (out_.network.segments[i].name == text(name, "territories.fed_by") &&
              out_.network.segments[i].terminal)
            found = static_cast<int>(i);
        if (found < 0) fail(name, "territories.fed_by", "a segment of the network with a terminal");
        t.segments.push_back(found);
      }
      if (entry["drained_by"].IsDefined() && !entry["drained_by"].IsSequence())
        fail(entry["drained_by"], "territories.drained_by", "a list of veins");
      for (const auto& name : entry["drained_by"]) {
        const std::string wanted = text(name, "territories.drained_by");
        const auto vein = std::find_if(out_.veins.begin(), out_.veins.end(),
                                       [&](const Vein& v) { return v.name == wanted; });
        if (vein == out_.veins.end()) fail(name, "territories.drained_by", "one of the veins");
        t.veins.push_back(static_cast<int>(vein - out_.veins.begin()));
      }
      source(entry["source"], "territories.source", "territories." + t.tissue);
      out_.territories.push_back(t);
    }
  }

  std::string file_;
  Vessels& out_;
};

}  // namespace

Vessels readVessels(const std::string& folder) {
  Vessels out;
  out.network = readCase(folder);
  const std::string file = folder + "/vessels.yaml";
  try {
    files::YamlLimits limits;
    limits.depth = kMostDepth;
    Reader(file, out).read(files::parseYaml(files::read(file, kMostBytes), limits));
  } catch (const files::Refused& why) {
    throw NetworkError(file, why.line, why.field, why.value, why.allowed);
  } catch (const YAML::Exception& e) {
    throw NetworkError(file, e.mark.line + 1, "yaml", "(" + e.msg + ")", "YAML as README.md describes it");
  }
  return out;
}

}  // namespace vest::haemodynamics

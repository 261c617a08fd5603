#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include <yaml-cpp/yaml.h>

#include "vest_instruments/control/pedals.h"
#include "vest_instruments/files/strict_yaml.h"
#include "vest_instruments/tools/tool_names.h"
#include "vest_instruments/trajectory/trajectory.h"
#include "vest_instruments/trajectory/waypoint.h"

namespace vest::trajectory {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostRows = 1000000;  // assumed: 2.7 h at 100 Hz

struct Press {
  double t;
  unsigned mask;
};

class Reader {
 public:
  explicit Reader(const std::string& path) : path_(path) {}

  [[noreturn]] void refuse(const std::string& field, const std::string& value,
                           const std::string& allowed) const {
    throw TrajectoryError(files::shown(path_, 4096) + ": " + files::shown(field, 200) + ": " +
                          files::shown(value, 100) + "; allowed: " + allowed);
  }
  void onlyKeys(const YAML::Node& node, const std::string& field,
                std::initializer_list<const char*> keys) const {
    std::string known;
    for (const char* k : keys) known += (known.empty() ? "" : ", ") + std::string(k);
    if (!node.IsMap()) refuse(field, "not a map", known);
    std::set<std::string> seen;
    for (const auto& entry : node) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
      if (!seen.insert(key).second) refuse(field, "key '" + key + "' given twice", "each key once");
      if (std::none_of(keys.begin(), keys.end(), [&](const char* k) { return key == k; })) {
        refuse(field, "unknown key '" + key + "'", known);
      }
    }
  }
  double number(const YAML::Node& node, const std::string& field, double lower, double upper) const {
    double v = NAN;
    try {
      if (node) v = node.as<double>();
    } catch (const YAML::Exception&) {
    }
    if (!(v >= lower && v <= upper)) {
      std::ostringstream allowed;
      allowed << "a number in " << lower << " … " << upper;
      refuse(field,
             !node             ? "missing"
             : node.IsScalar() ? "'" + node.Scalar() + "'"
                               : "no number",
             allowed.str());
    }
    return v;
  }

  std::vector<Waypoint> waypoints(const YAML::Node& list, const std::string& field,
                                  const kinematics::TrainerArm& arm) const {
    if (!list.IsSequence() || list.size() == 0) refuse(field, "not a list", "waypoints {t, tip, roll, jaw}");
    std::vector<Waypoint> out;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string at = field + "[" + std::to_string(i) + "]";
      const YAML::Node& n = list[i];
      onlyKeys(n, at, {"t", "tip", "roll", "jaw", "through"});
      Waypoint w{number(n["t"], at + ".t", 0.0, 36000.0), {}, 0.0, 0.0, false};
      if (!out.empty() && w.t <= out.back().t)
        refuse(at + ".t", n["t"].Scalar(), "later than the one before");
      const YAML::Node tip = n["tip"];
      if (!tip || !tip.IsSequence() || tip.size() != 3) refuse(at + ".tip", "no point", "[x, y, z] in m");
      for (int k = 0; k < 3; ++k) w.tip[k] = number(tip[k], at + ".tip", -2.0, 2.0);
      w.roll = n["roll"] ? number(n["roll"], at + ".roll", arm.limits.lower.roll, arm.limits.upper.roll)
                         : (out.empty() ? 0.0 : out.back().roll);
      w.jaw = n["jaw"] ? number(n["jaw"], at + ".jaw", arm.limits.lower.jaw, arm.limits.upper.jaw)
                       : (out.empty() ? 0.0 : out.back().jaw);
      if (n["through"] && !YAML::convert<bool>::decode(n["through"], w.through)) {
        refuse(at + ".through", "no truth value", "true, false");
      }
      out.push_back(w);
    }
    return out;
  }

  tools::ToolKind tool(const YAML::Node& n, const std::string& at) const {
    const std::string word = n.IsScalar() ? n.Scalar() : "?";
    const auto kind = tools::toolFromName(word);
    if (!kind || *kind == tools::ToolKind::Endoscope) refuse(at, "'" + word + "'", tools::handTools());
    return *kind;
  }

  // Pedals by their names in the preset `trainer`, which a script brings with it.
  std::vector<Press> presses(const YAML::Node& list) const {
    const auto pedals = control::footswitchPreset("trainer")->names;
    const std::string names = "coag, cut, irrigation, suction, tool, clutch or 0 … 5";
    if (!list.IsSequence()) refuse("footswitches", "not a list", "entries {t, pressed: [" + names + "]}");
    std::vector<Press> out;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string at = "footswitches[" + std::to_string(i) + "]";
      const YAML::Node& n = list[i];
      onlyKeys(n, at, {"t", "pressed"});
      Press p{number(n["t"], at + ".t", 0.0, 36000.0), 0};
      if (!out.empty() && p.t <= out.back().t)
        refuse(at + ".t", n["t"].Scalar(), "later than the one before");
      if (!n["pressed"] || !n["pressed"].IsSequence()) refuse(at + ".pressed", "no list", names);
      for (const auto& entry : n["pressed"]) {
        const std::string word = entry.IsScalar() ? entry.Scalar() : "?";
        unsigned bit = 6;
        for (unsigned k = 0; k < pedals.size(); ++k) {
          if (word == pedals[k] || word == std::to_string(k)) bit = k;
        }
        if (bit == 6) refuse(at + ".pressed", "'" + word + "'", names);
        p.mask |= 1u << bit;
      }
      out.push_back(p);
    }
    return out;
  }

 private:
  const std::string& path_;
};

/// Slope with which a value passes waypoint i: the parabola through its neighbours (Catmull and Rom 1974,
/// uneven times); 0 at a turning point and never more than twice the gentler side, so that nothing
/// overshoots.
template <typename Get>
double slopeAt(const std::vector<Waypoint>& w, std::size_t i, Get get) {
  if (i == 0 || i + 1 >= w.size() || !w[i].through) return 0.0;
  const double before = w[i].t - w[i - 1].t, after = w[i + 1].t - w[i].t;
  const double a = (get(w[i]) - get(w[i - 1])) / before, b = (get(w[i + 1]) - get(w[i])) / after;
  if (a * b <= 0.0) return 0.0;
  const double v = (a * after + b * before) / (before + after),
               most = 2.0 * std::min(std::abs(a), std::abs(b));
  return std::clamp(v, -most, most);
}

}  // namespace

Waypoint at(const std::vector<Waypoint>& w, double t) {
  if (t <= w.front().t) return w.front();
  if (t >= w.back().t) return w.back();
  const auto next =
      std::upper_bound(w.begin(), w.end(), t, [](double v, const Waypoint& x) { return v < x.t; });
  const auto i = static_cast<std::size_t>(next - w.begin());
  const double span = w[i].t - w[i - 1].t, s = (t - w[i - 1].t) / span;
  const double m = s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
  const double leave = s + s * s * s * (-6.0 + s * (8.0 - 3.0 * s));  // slope 1 at s = 0, else 0
  const double arrive = s * s * s * (-4.0 + s * (7.0 - 3.0 * s));     // slope 1 at s = 1, else 0
  const auto blend = [&](auto get) {
    const double p = get(w[i - 1]), q = get(w[i]);
    return p + m * (q - p) + span * (leave * slopeAt(w, i - 1, get) + arrive * slopeAt(w, i, get));
  };
  Waypoint out{t, {}, 0.0, 0.0, false};
  for (int k = 0; k < 3; ++k) out.tip[k] = blend([k](const Waypoint& x) { return x.tip[k]; });
  out.roll = blend([](const Waypoint& x) { return x.roll; });
  out.jaw = blend([](const Waypoint& x) { return x.jaw; });
  return out;
}

Trajectory fromWaypoints(const std::string& path, const kinematics::TrainerBox& box) try {
  files::YamlLimits limits;
  limits.depth = 16;
  const YAML::Node root = files::parseYaml(files::read(path, 1 << 20), limits);
  const Reader reader(path);
  reader.onlyKeys(root, "the file",
                  {"rate", "instruments", "footswitches", "tools", "tool_tray", "effects", "pictures"});
  const double rate = root["rate"] ? reader.number(root["rate"], "rate", 1.0, 1000.0) : 100.0;
  const YAML::Node instruments = root["instruments"];
  if (!instruments) reader.refuse("instruments", "missing", "left, right, third, endoscope");
  reader.onlyKeys(instruments, "instruments", {"left", "right", "third", "endoscope"});

  Trajectory out;
  std::array<std::vector<Waypoint>, tools::kInstrumentCount> ways;
  double end = 0.0;
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const std::string name(tools::instrumentName(static_cast<tools::Instrument>(i)));
    if (!instruments[name]) continue;
    if (!box.arms[i].present)
      reader.refuse("instruments." + name, "not in this box", "the box's instruments");
    ways[i] = reader.waypoints(instruments[name], "instruments." + name, box.arms[i]);
    out.moves[i] = true;
    end = std::max(end, ways[i].back().t);
  }
  if (const YAML::Node hands = root["tools"]) {
    reader.onlyKeys(hands, "tools", {"left", "right", "third"});
    for (std::size_t i = 0; i < out.tools.size(); ++i) {
      const std::string name(tools::instrumentName(static_cast<tools::Instrument>(i)));
      if (hands[name]) out.tools[i] = reader.tool(hands[name], "tools." + name);
    }
  }
  if (const YAML::Node tray = root["tool_tray"]) {
    if (!tray.IsSequence()) reader.refuse("tool_tray", "not a list", "tools by name");
    for (std::size_t i = 0; i < tray.size(); ++i)
      out.tool_tray.push_back(reader.tool(tray[i], "tool_tray[" + std::to_string(i) + "]"));
  }
  if (const YAML::Node effects = root["effects"]) {
    const auto name = [&](const YAML::Node& key) {
      if (!key.IsScalar()) reader.refuse("effects", "a key that is no word", "names");
      return key.Scalar();
    };
    if (!effects.IsMap()) reader.refuse("effects", "not a map", "numbers of the Trainer's ~effects");
    for (const auto& entry : effects) {
      const std::string group = name(entry.first);
      if (!entry.second.IsMap()) {
        out.effects[group] = reader.number(entry.second, "effects." + group, -1e9, 1e9);
        continue;
      }
      for (const auto& inner : entry.second) {
        const std::string path = group + "/" + name(inner.first);
        out.effects[path] = reader.number(inner.second, "effects." + path, -1e9, 1e9);
      }
    }
  }
  if (const YAML::Node moments = root["pictures"]) {
    if (!moments.IsSequence()) reader.refuse("pictures", "not a list", "times in s");
    for (std::size_t i = 0; i < moments.size(); ++i) {
      const std::string at = "pictures[" + std::to_string(i) + "]";
      const double earliest = out.pictures.empty() ? 0.0 : out.pictures.back();
      out.pictures.push_back(reader.number(moments[i], at, earliest, 36000.0));
    }
  }
  std::vector<Press> presses;
  if (root["footswitches"]) {
    presses = reader.presses(root["footswitches"]);
    out.has_footswitches = true;
    if (!presses.empty()) end = std::max(end, presses.back().t);
  }

  std::array<kinematics::JointPositions, tools::kInstrumentCount> reference;
  const auto rows = static_cast<std::size_t>(std::floor(end * rate + 1e-6)) + 1;
  if (rows > kMostRows)
    reader.refuse("rate", std::to_string(rows) + " rows until the last time",
                  "at most " + std::to_string(kMostRows) + ": a lower rate, or an earlier end");
  out.rows.reserve(rows);
  std::size_t pressed = 0;
  for (std::size_t k = 0; k < rows; ++k) {
    Row row;
    row.t = static_cast<double>(k) / rate;
    for (std::size_t i = 0; i < ways.size(); ++i) {
      if (ways[i].empty()) continue;
      const Waypoint w = at(ways[i], row.t);
      const auto result =
          kinematics::inverseKinematics(box.arms[i].X_BTrocar, Eigen::Isometry3d(Eigen::Translation3d(w.tip)),
                                        reference[i], box.arms[i].limits);
      if (!result.reachable) {
        std::ostringstream value;
        value << "at t = " << row.t << " s the tip [" << w.tip.transpose() << "] is out of reach";
        reader.refuse("instruments." + std::string(tools::instrumentName(static_cast<tools::Instrument>(i))),
                      value.str(), "points within the joint limits of the trainer box");
      }
      row.joints[i] = result.q;
      row.joints[i].roll = w.roll;
      row.joints[i].jaw = w.jaw;
      reference[i] = row.joints[i];
    }
    for (; pressed < presses.size() && presses[pressed].t <= row.t + 1e-9; ++pressed) {
    }
    if (pressed > 0) row.footswitches = presses[pressed - 1].mask;
    out.rows.push_back(row);
  }
  return out;
} catch (const files::Refused& why) {
  throw TrajectoryError(files::shown(path, 4096) + ": " +
                        (why.line > 0 ? "line " + std::to_string(why.line) : why.field) + ": " +
                        files::shown(why.value) + "; allowed: " + why.allowed);
} catch (const YAML::Exception& e) {
  throw TrajectoryError(files::shown(path, 4096) + ": line " + std::to_string(e.mark.line + 1) + ": " +
                        e.msg + "; allowed: YAML");
}

}  // namespace vest::trajectory

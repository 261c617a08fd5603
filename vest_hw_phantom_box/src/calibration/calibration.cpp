#include "vest_hw_phantom_box/calibration/calibration.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <set>
#include <sstream>

#include "vest_instruments/files/strict_yaml.h"

namespace vest::calibration {
namespace {

using protocol::kAxes;
using protocol::kJoints;

[[noreturn]] void fail(const std::string& file, const std::string& field, const std::string& value,
                       const std::string& allowed) {
  throw Error(files::shown(file, 4096) + ": " + files::shown(field, 200) + ": " + files::shown(value, 100) +
              "; allowed: " + allowed);
}

std::string shown(const YAML::Node& node) {
  if (node.IsScalar()) return "'" + node.Scalar() + "'";
  return node.IsMap() ? "a map" : node.IsSequence() ? "a list" : "nothing";
}

std::string joined(const std::set<std::string>& names) {
  std::string all;
  for (const auto& n : names) all += (all.empty() ? "" : ", ") + n;
  return all;
}

void checkKeys(const YAML::Node& map, const std::string& file, const std::string& where,
               const std::set<std::string>& required, const std::set<std::string>& optional) {
  std::set<std::string> known = required;
  known.insert(optional.begin(), optional.end());
  if (!map.IsMap()) fail(file, where, shown(map), "a map with the keys " + joined(known));
  std::set<std::string> seen;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar()) fail(file, where, "a key that is not a word", joined(known));
    const std::string key = entry.first.Scalar();
    if (!known.count(key)) fail(file, where + "." + key, "unknown key", joined(known));
    if (!seen.insert(key).second) fail(file, where + "." + key, "stands there twice", "once");
  }
  for (const auto& key : required)
    if (!seen.count(key)) fail(file, where + "." + key, "is missing", "every one of " + joined(required));
}

double number(const YAML::Node& node, const std::string& file, const std::string& where, double low,
              double high) {
  std::ostringstream allowed;
  allowed << "a finite number from " << low << " to " << high;
  double value = 0;
  try {
    if (!node.IsScalar()) throw std::runtime_error("");
    value = node.as<double>();
  } catch (const std::exception&) {
    fail(file, where, shown(node), allowed.str());
  }
  if (!std::isfinite(value) || value < low || value > high) fail(file, where, shown(node), allowed.str());
  return value;
}

constexpr double kLeastOfATurn = 2 * M_PI / 65535;  // rad per count

Joint parseJoint(const YAML::Node& node, const std::string& file, const std::string& where) {
  checkKeys(node, file, where, {"per_count", "sign", "zero_count", "min", "max", "max_speed"},
            {"continuous"});
  Joint j;
  j.per_count = number(node["per_count"], file, where + ".per_count", 1e-9, 0.1);
  const double sign = number(node["sign"], file, where + ".sign", -1, 1);
  if (sign != 1 && sign != -1) fail(file, where + ".sign", shown(node["sign"]), "1 or -1");
  j.sign = static_cast<int>(sign);
  j.zero_count = number(node["zero_count"], file, where + ".zero_count", -32767, 32767);
  j.min = number(node["min"], file, where + ".min", -100, 100);
  j.max = number(node["max"], file, where + ".max", -100, 100);
  if (!(j.min < j.max))
    fail(file, where + ".min", shown(node["min"]), "less than max (" + node["max"].Scalar() + ")");
  // The largest step of 32767 counts bounds what the sensor can say at all.
  j.max_speed = number(node["max_speed"], file, where + ".max_speed", 1e-3, 1e4);
  const YAML::Node continuous = node["continuous"];
  if (!continuous) return j;
  if (!continuous.IsScalar() || !YAML::convert<bool>::decode(continuous, j.continuous))
    fail(file, where + ".continuous", shown(continuous), "true or false");
  if (j.continuous && j.per_count < kLeastOfATurn) {
    std::ostringstream allowed;
    allowed << kLeastOfATurn << " or more where continuous: a turn has to fit into 16 bits";
    fail(file, where + ".per_count", shown(node["per_count"]), allowed.str());
  }
  return j;
}

void parseArm(const YAML::Node& node, const std::string& file, int arm, Calibration& c) {
  const std::string where = protocol::armNames()[arm];
  const bool endoscope = arm == protocol::kMaxInstruments;
  const std::set<std::string> four{"yaw", "pitch", "insertion", "roll"};
  std::set<std::string> required = four;
  if (!endoscope) required.insert("jaw");
  checkKeys(node, file, where, required,
            endoscope ? std::set<std::string>{"light_post"} : std::set<std::string>{});
  const char* axes[] = {"yaw", "pitch", "insertion", "roll", endoscope ? "light_post" : "jaw"};
  for (int a = 0; a < kAxes; ++a) {
    if (!node[axes[a]]) continue;
    c.joints[arm * kAxes + a] = parseJoint(node[axes[a]], file, where + "." + axes[a]);
  }
  if (endoscope) c.has_light_post = static_cast<bool>(node["light_post"]);
}

}  // namespace

double Joint::near(double position, double reference) const {
  return continuous ? position + 2 * M_PI * std::nearbyint((reference - position) / (2 * M_PI)) : position;
}

std::int16_t Joint::count(double position) const {
  double raw = position / (sign * per_count) + zero_count;
  if (continuous) raw = std::remainder(raw, 2 * M_PI / per_count);
  raw = std::nearbyint(raw);
  return static_cast<std::int16_t>(raw > 32767 ? 32767 : raw < -32767 ? -32767 : raw);
}

Calibration defaultCalibration() {
  Calibration c;
  for (int i = 0; i < kJoints; ++i) {
    Joint& j = c.joints[i];
    switch (i % kAxes) {
      case 0:
      case 1:
        j.min = -1.2, j.max = 1.2;
        break;
      case 2:
        j.per_count = 1e-5, j.min = 0, j.max = 0.28, j.max_speed = 10;
        break;
      case 3:
        j.min = -100, j.max = 100, j.max_speed = 100, j.continuous = true;
        break;
      default:
        j.min = 0, j.max = 1.2;
        break;
    }
  }
  c.joints[protocol::kLightPost].min = -3.1416;
  c.joints[protocol::kLightPost].max = 3.1416;
  c.joints[protocol::kLightPost].max_speed = 100;
  return c;
}

Calibration parseCalibration(const std::string& source, const std::string& name) {
  YAML::Node root;
  try {
    files::YamlLimits limits;
    limits.depth = 8;
    root = files::parseYaml(source, limits);
  } catch (const files::Refused& why) {
    fail(name, "line " + std::to_string(why.line), why.value, why.allowed);
  }
  checkKeys(root, name, "calibration file", {"left", "right", "endoscope"}, {"third"});
  Calibration c = defaultCalibration();
  c.has_third = static_cast<bool>(root["third"]);
  for (int arm = 0; arm <= protocol::kMaxInstruments; ++arm)
    if (root[protocol::armNames()[arm]]) parseArm(root[protocol::armNames()[arm]], name, arm, c);
  return c;
}

Calibration loadCalibration(const std::string& file) {
  std::string text;
  try {
    text = files::read(file, 1 << 20);
  } catch (const files::Refused& why) {
    fail(file, "calibration file", why.value, why.allowed);
  }
  return parseCalibration(text, file);
}

}  // namespace vest::calibration

// Parameters of the driver, each checked for type and range.
#include <algorithm>
#include <cctype>
#include <set>
#include <sstream>

#include "phantom_box_shell.h"

namespace vest::ros_shell {
namespace {

using Value = XmlRpc::XmlRpcValue;

std::string shown(const Value& v) {
  std::ostringstream text;
  v.write(text);
  return text.str();
}

[[noreturn]] void fail(const ros::NodeHandle& nh, const std::string& name, const std::string& value,
                       const std::string& allowed) {
  throw ParameterError("parameter " + nh.resolveName(name) + ": " + value + "; allowed: " + allowed);
}

bool get(const ros::NodeHandle& nh, const std::string& name, Value::Type type, const std::string& allowed,
         Value& v) {
  if (!nh.getParam(name, v)) return false;
  if (v.getType() != type) fail(nh, name, shown(v), allowed);
  return true;
}

std::string text(const ros::NodeHandle& nh, const std::string& name, const std::string& fallback,
                 const std::string& allowed) {
  Value v;
  return get(nh, name, Value::TypeString, allowed, v) ? static_cast<std::string>(v) : fallback;
}

using Names = std::array<std::string, protocol::kFootswitches>;

Names pedalNames(const ros::NodeHandle& nh) {
  const std::string presets = "trainer, dvrk, custom (with footswitch_names)";
  const std::string preset = text(nh, "footswitch_preset", "trainer", presets);
  const bool named = nh.hasParam("footswitch_names");
  if (preset != "custom" && named && nh.hasParam("footswitch_preset"))
    fail(nh, "footswitch_names", "given together with footswitch_preset '" + preset + "'", "preset custom");
  if (!named && preset == "trainer") return {"coag", "cut", "irrigation", "suction", "tool", "clutch"};
  if (!named && preset == "dvrk") return {"clutch", "camera", "cam_minus", "cam_plus", "bicoag", "coag"};
  if (!named) fail(nh, "footswitch_preset", "'" + preset + "'", presets);
  const std::string allowed = "a list of six different names of letters, digits and _, a letter first";
  Value list;
  get(nh, "footswitch_names", Value::TypeArray, allowed, list);
  if (list.size() != protocol::kFootswitches) fail(nh, "footswitch_names", shown(list), allowed);
  Names names;
  std::set<std::string> seen;
  for (int i = 0; i < protocol::kFootswitches; ++i) {
    if (list[i].getType() != Value::TypeString) fail(nh, "footswitch_names", shown(list), allowed);
    names[i] = static_cast<std::string>(list[i]);
    const bool word = !names[i].empty() && std::isalpha(static_cast<unsigned char>(names[i][0])) &&
                      std::all_of(names[i].begin(), names[i].end(),
                                  [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (!word || !seen.insert(names[i]).second) fail(nh, "footswitch_names", shown(list), allowed);
  }
  return names;
}

void warnUnknown(const ros::NodeHandle& nh) {
  const std::string own = nh.getNamespace() + "/";
  const std::set<std::string> known{"port", "baud_rate", "calibration", "footswitch_preset",
                                    "footswitch_names"};
  std::vector<std::string> all;
  nh.getParamNames(all);
  for (const std::string& name : all)
    if (name.rfind(own, 0) == 0 && !known.count(name.substr(own.size())))
      ROS_WARN("phantom_box: parameter %s: unknown, has no effect", name.c_str());
}

}  // namespace

Parameters readParameters(const ros::NodeHandle& nh) {
  warnUnknown(nh);
  Parameters p;
  p.reader.port = text(nh, "port", "/dev/ttyUSB0", "a path to a serial device");
  if (p.reader.port.empty()) fail(nh, "port", "''", "a path to a serial device");
  const std::string rates = "a whole number of baud from 9600 to 4000000";
  Value v;
  if (get(nh, "baud_rate", Value::TypeInt, rates, v)) {
    const int rate = v;
    if (rate < 9600 || rate > 4000000) fail(nh, "baud_rate", std::to_string(rate), rates);
    p.reader.baud_rate = static_cast<unsigned>(rate);
  }
  const std::string file = text(nh, "calibration", "", "a path to a calibration file");
  p.calibration = file.empty() ? calibration::defaultCalibration() : calibration::loadCalibration(file);
  p.pedals = pedalNames(nh);
  return p;
}

}  // namespace vest::ros_shell

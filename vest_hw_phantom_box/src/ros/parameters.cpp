// Parameters of the driver, each checked for type and range.
#include <set>
#include <sstream>

#include "phantom_box_shell.h"
#include "vest_instruments/ros/footswitches.h"

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

// What pedals mean is told to the session, not to the driver alone: it acts by their names, others by their
// functions.
void refusePrivatePreset(const ros::NodeHandle& nh) {
  for (const char* name : {"footswitch_preset", "footswitch_names"})
    if (nh.hasParam(name))
      fail(nh, name, "given to the driver alone",
           std::string(name) + " in the session's namespace, where the instruments read it, too");
}

void warnUnknown(const ros::NodeHandle& nh) {
  const std::string own = nh.getNamespace() + "/";
  const std::set<std::string> known{"port", "baud_rate", "calibration", "raw_log"};
  std::vector<std::string> all;
  nh.getParamNames(all);
  for (const std::string& name : all)
    if (name.rfind(own, 0) == 0 && !known.count(name.substr(own.size())))
      ROS_WARN("phantom_box: parameter %s: unknown, has no effect", name.c_str());
}

}  // namespace

Parameters readParameters(const ros::NodeHandle& session_nh, const ros::NodeHandle& nh) {
  refusePrivatePreset(nh);
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
  p.reader.raw_log = text(nh, "raw_log", "", "a path of a file for the bytes of the line");
  const std::string file = text(nh, "calibration", "", "a path to a calibration file");
  p.calibration = file.empty() ? calibration::defaultCalibration() : calibration::loadCalibration(file);
  p.pedals = vest_instruments::readFootswitches(session_nh).names;
  return p;
}

}  // namespace vest::ros_shell

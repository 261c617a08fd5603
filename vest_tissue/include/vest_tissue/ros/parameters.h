#pragma once

#include <stdexcept>
#include <string>

#include <ros/node_handle.h>

/// Parameters with their type and range checked; a refusal names the parameter, its value and what is
/// allowed.
namespace vest::ros_shell {

inline std::string parameterText(XmlRpc::XmlRpcValue value) {
  return value.toXml();
}

[[noreturn]] inline void refuseParameter(const ros::NodeHandle& nh, const std::string& name,
                                         const std::string& value, const std::string& allowed) {
  throw std::invalid_argument("parameter " + nh.resolveName(name) + ": " + value + " (allowed: " + allowed +
                              ")");
}

inline double doubleParameter(const ros::NodeHandle& nh, const std::string& name, double fallback,
                              double lowest, double highest) {
  XmlRpc::XmlRpcValue v;
  if (!nh.getParam(name, v)) return fallback;
  const std::string allowed = "a number from " + std::to_string(lowest) + " to " + std::to_string(highest);
  double x = 0.0;
  if (v.getType() == XmlRpc::XmlRpcValue::TypeDouble) {
    x = static_cast<double>(v);
  } else if (v.getType() == XmlRpc::XmlRpcValue::TypeInt) {
    x = static_cast<int>(v);
  } else {
    refuseParameter(nh, name, parameterText(v), allowed);
  }
  if (!(x >= lowest && x <= highest)) refuseParameter(nh, name, std::to_string(x), allowed);
  return x;
}

inline int intParameter(const ros::NodeHandle& nh, const std::string& name, int fallback, int lowest,
                        int highest) {
  XmlRpc::XmlRpcValue v;
  if (!nh.getParam(name, v)) return fallback;
  const std::string allowed =
      "a whole number from " + std::to_string(lowest) + " to " + std::to_string(highest);
  if (v.getType() != XmlRpc::XmlRpcValue::TypeInt) refuseParameter(nh, name, parameterText(v), allowed);
  const int x = static_cast<int>(v);
  if (x < lowest || x > highest) refuseParameter(nh, name, std::to_string(x), allowed);
  return x;
}

inline bool boolParameter(const ros::NodeHandle& nh, const std::string& name, bool fallback) {
  XmlRpc::XmlRpcValue v;
  if (!nh.getParam(name, v)) return fallback;
  if (v.getType() != XmlRpc::XmlRpcValue::TypeBoolean)
    refuseParameter(nh, name, parameterText(v), "true or false");
  return static_cast<bool>(v);
}

inline std::string stringParameter(const ros::NodeHandle& nh, const std::string& name,
                                   const std::string& fallback) {
  XmlRpc::XmlRpcValue v;
  if (!nh.getParam(name, v)) return fallback;
  if (v.getType() != XmlRpc::XmlRpcValue::TypeString) refuseParameter(nh, name, parameterText(v), "a text");
  return static_cast<std::string>(v);
}

}  // namespace vest::ros_shell

#pragma once

#include <stdexcept>
#include <string>

#include <ros/init.h>
#include <ros/names.h>
#include <ros/param.h>

namespace vest::ros_shell {

/// What stands before the names of this session's frames, as robot_state_publisher's `tf_prefix` does: empty,
/// or words that end in a slash. Of `b`, `/b` and `b/` each gives `b/`.
/// @throws std::invalid_argument that says what is allowed
inline std::string withSlashes(const std::string& prefix) {
  const auto bad = [](char c) {
    const bool word = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    return !word && c != '_' && c != '-' && c != '.' && c != '/';
  };
  std::string text = prefix.substr(!prefix.empty() && prefix[0] == '/');
  if (text.empty()) return text;
  if (text.back() != '/') text += '/';
  bool wrong = text[0] == '/' || text.find("//") != std::string::npos;
  for (const char c : text) wrong = wrong || bad(c);
  if (wrong) throw std::invalid_argument("'" + prefix + "'; allowed: letters, digits, _ - . and /, as in b/");
  return text;
}

/// Prefix of this process's session: its parameter `frame_prefix`, as it was at the first call. A process
/// without ROS has none, nor has what it writes into files.
/// @throws std::runtime_error that names the parameter, its value and what is allowed
inline const std::string& framePrefix() {
  static const std::string prefix = [] {
    constexpr const char* kName = "frame_prefix";
    std::string text;
    XmlRpc::XmlRpcValue value;
    if (!ros::isInitialized() || !ros::param::get(kName, value)) return text;
    const std::string where = "parameter " + ros::names::resolve(kName) + ": ";
    if (value.getType() != XmlRpc::XmlRpcValue::TypeString)
      throw std::runtime_error(where + "no word; allowed: a text, as in b/");
    try {
      return withSlashes(static_cast<std::string&>(value));
    } catch (const std::invalid_argument& e) {
      throw std::runtime_error(where + e.what());
    }
  }();
  return prefix;
}

/// Name of a frame of this session, as messages and tf bear it. @param name as docs/ros_interface.md has it
inline std::string frameId(const std::string& name) {
  return framePrefix() + name;
}

}  // namespace vest::ros_shell

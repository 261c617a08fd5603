#pragma once

#include <string>

#include <boost/shared_ptr.hpp>
#include <pluginlib/class_loader.hpp>

#include "vest_haptics/device/device.h"

namespace vest::ros_shell {

/// Devices by the words of the launch files (sim, phantom …) or by the full names of plug-ins.
class DevicePlugins {
 public:
  DevicePlugins();
  /// @throws std::runtime_error naming the word, and what is allowed or who declares it twice: pluginlib
  /// itself would take one of two plug-ins of one name, and not say which
  boost::shared_ptr<haptics::Device> create(const std::string& word);

 private:
  pluginlib::ClassLoader<haptics::Device> loader_;
};

}  // namespace vest::ros_shell

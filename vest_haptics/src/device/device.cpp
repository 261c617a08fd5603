#include "vest_haptics/device/device.h"

#include <cstdlib>
#include <sstream>

namespace vest::haptics {

const char* statusName(DeviceStatus status) {
  switch (status) {
    case DeviceStatus::Ok:
      return "ok";
    case DeviceStatus::Starting:
      return "starting";
    case DeviceStatus::Uncalibrated:
      return "not calibrated";
    case DeviceStatus::Unplugged:
      return "unplugged";
    case DeviceStatus::Error:
      return "error";
  }
  return "?";
}

void checkOptions(const std::string& device, const DeviceOptions& options, const std::string& allowed) {
  for (const auto& [key, value] : options) {
    std::istringstream words(allowed);
    std::string word;
    bool known = false;
    while (words >> word) known |= word == key;
    if (!known)
      throw DeviceError(device + ": option '" + key + "' = '" + value + "' is unknown; allowed: " + allowed);
  }
}

std::string option(const DeviceOptions& options, const std::string& key, const std::string& otherwise) {
  const auto it = options.find(key);
  return it == options.end() || it->second.empty() ? otherwise : it->second;
}

double numberOption(const DeviceOptions& options, const std::string& key, double otherwise, double least,
                    double most) {
  const std::string text = option(options, key, "");
  if (text.empty()) return otherwise;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end != text.c_str() + text.size() || !(value >= least && value <= most)) {
    std::ostringstream message;
    message << "option '" << key << "' = '" << text << "'; allowed: " << least << " … " << most;
    throw DeviceError(message.str());
  }
  return value;
}

}  // namespace vest::haptics

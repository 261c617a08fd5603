#include "vest_haptics/device/device.h"

#include <locale>
#include <sstream>

#include "vest_instruments/files/read.h"

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

std::string unsound(const Capabilities& c) {
  // N or N·m, assumed: the strongest device of a page here, Force Dimension's sigma.7, shows 20 N.
  constexpr double kStrongest = 100.0;
  const auto outside = [](const char* what, double value, double least, double most) {
    if (isFinite(value) && value >= least && value <= most) return std::string();
    std::ostringstream message;
    message.imbue(std::locale::classic());
    message << what << " = " << value << "; allowed: " << least << " … " << most;
    return message.str();
  };
  if (c.model.empty()) return "model is empty; allowed: a name for people";
  std::string wrong;
  const auto check = [&](const char* what, double value, double least, double most) {
    if (wrong.empty()) wrong = outside(what, value, least, most);
  };
  for (int i = 0; i < (c.joints ? kChannels : 1); ++i) check("maximum", c.maximum[i], 1e-6, kStrongest);
  check("damping", c.damping, 0.0, 1e3);
  check("stiffness", c.stiffness, 1e-3, 1e6);
  check("watchdog", c.watchdog, 0.0, 1e3);
  check("rate", c.rate, 1.0, 1e5);
  check("delay", c.delay, 0.0, 0.1);
  check("continuous", c.continuous, 0.0, kStrongest);
  check("buttons", c.buttons, 0.0, 32.0);
  return wrong;
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
  double value = 0.0;
  if (!files::parseNumber(text, value) || !(value >= least && value <= most)) {
    std::ostringstream message;
    message.imbue(std::locale::classic());
    message << "option '" << key << "' = '" << text << "'; allowed: " << least << " … " << most;
    throw DeviceError(message.str());
  }
  return value;
}

}  // namespace vest::haptics

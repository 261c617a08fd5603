#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "vest_haptics/device/device.h"

namespace vest::haptics::conformance {

struct Finding {
  std::string promise;  ///< a sentence
  bool kept = false;
  std::string detail;
};

struct Options {
  DeviceOptions device;
  double seconds = 0.5;     ///< length of the motion that is watched
  bool small_force = true;  ///< shows 2 % of the maximum for 0.1 s: hold the handle
  /// Allocations of the calling thread so far; empty: not watched.
  std::function<std::uint64_t()> allocations;
};

/// What every plug-in must do, tried on one. Takes some seconds; a hand may hold the device but must not
/// throw it. Simulated devices are advanced by the suite.
std::vector<Finding> run(Device& device, const Options& options);

}  // namespace vest::haptics::conformance

// From encoder counts to radians and metres.
#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::calibration {

/// position = sign · per_count · (count − zero_count), kept within [min, max].
struct Joint {
  double per_count = 1e-4;  ///< rad or m per count, > 0
  int sign = 1;             ///< +1 or −1
  double zero_count = 0;    ///< count at position 0
  double min = -1;          ///< rad or m
  double max = 1;           ///< rad or m
  double max_speed = 50;    ///< rad/s or m/s; faster is a broken sensor, not a hand
  /// A shaft that turns round and round: 16 bits hold one turn, counts come back after it, and the driver
  /// counts the turns.
  bool continuous = false;

  double position(std::int16_t count) const { return sign * per_count * (count - zero_count); }
  /// Of a continuous joint: the position in the turn nearest to a reference, rad. Of others: the position.
  double near(double position, double reference) const;
  /// Nearest count, within what 16 bits hold (−32768 is no count: it says "no reading"). Of a continuous
  /// joint the turn that fits.
  std::int16_t count(double position) const;
};

struct Calibration {
  std::array<Joint, protocol::kJoints> joints;
  bool has_third = true;       ///< the file describes a third instrument
  bool has_light_post = true;  ///< the file describes the endoscope's light post
};

/// One message: file, field, value, what is allowed.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Plausible values for every joint; the same as config/default.yaml.
Calibration defaultCalibration();
/// Strict: an unknown or missing key, a number that is not finite, min ≥ max … throws Error.
Calibration loadCalibration(const std::string& file);
/// `name` stands for the file in messages.
Calibration parseCalibration(const std::string& text, const std::string& name);

}  // namespace vest::calibration

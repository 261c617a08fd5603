#pragma once

#include <cmath>
#include <cstdio>
#include <string>

#include <ros/time.h>

namespace vest::ros_shell {

/// s: a command whose stamp is older, or lies further ahead, is refused. Longer than any queue of a session
/// that runs, shorter than a person's pause (assumed).
inline constexpr double kOldestCommand = 1.0;

/// Why a command is refused for its stamp; empty: it is taken. Stamp 0 means now, for released CRTK clients
/// stamp none (docs/decisions/0008-crtk.md).
/// @param oldest s
inline std::string wrongStamp(const ros::Time& stamp, double oldest = kOldestCommand) {
  if (stamp.isZero()) return {};
  const double age = (ros::Time::now() - stamp).toSec();
  if (std::abs(age) <= oldest) return {};
  char text[96];
  if (age > 0.0)
    std::snprintf(text, sizeof text, "its stamp is %.4g s old; allowed: %.4g s, or 0, which means now", age,
                  oldest);
  else
    std::snprintf(text, sizeof text, "its stamp lies %.4g s ahead: set the client's clock", -age);
  return text;
}

/// The same for a word of `state_command`. What stops an arm is never too late.
inline std::string wrongStamp(const ros::Time& stamp, const std::string& word) {
  return word == "disable" || word == "pause" ? std::string() : wrongStamp(stamp);
}

}  // namespace vest::ros_shell

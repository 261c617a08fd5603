#pragma once

#include <algorithm>
#include <cmath>
#include <deque>

#include <ros/time.h>

namespace vest::ros_shell {

/// The message whose stamp is nearest to `moment`, the earlier one of two that are as near. `messages`: by
/// rising stamp. Null where there are none.
template <class Pointer>
Pointer nearestStamp(const std::deque<Pointer>& messages, const ros::Time& moment) {
  const auto after =
      std::lower_bound(messages.begin(), messages.end(), moment,
                       [](const Pointer& m, const ros::Time& wanted) { return m->header.stamp < wanted; });
  if (after == messages.begin()) return messages.empty() ? Pointer() : *after;
  const Pointer& before = *(after - 1);
  if (after == messages.end()) return before;
  const auto away = [&](const Pointer& m) {  // as numbers: ros::Duration throws when far
    return std::fabs(m->header.stamp.toSec() - moment.toSec());
  };
  return away(before) <= away(*after) ? before : *after;
}

}  // namespace vest::ros_shell

#include "instrument_history.h"

#include <algorithm>

namespace vest::displays {

void InstrumentHistory::add(const vest_msgs::InstrumentStates::ConstPtr& m) {
  if (!all_.empty() && m->header.stamp < all_.back()->header.stamp) all_.clear();
  all_.push_back(m);
  if (all_.size() > kMost) all_.pop_front();
}

vest_msgs::InstrumentStates::ConstPtr InstrumentHistory::at(const ros::Time& stamp, double age) const {
  if (all_.empty()) return nullptr;
  const auto time = [](const auto& m) { return m->header.stamp.toSec(); };  // ros::Duration throws when far
  const bool still = age > kStandsStill && time(all_.back()) - stamp.toSec() > kStandsStill;
  if (stamp.isZero() || still) return all_.back();
  const auto after =
      std::lower_bound(all_.begin(), all_.end(), stamp,
                       [](const auto& m, const ros::Time& wanted) { return m->header.stamp < wanted; });
  if (after == all_.end()) return all_.back();
  if (after == all_.begin()) return *after;
  const auto before = after - 1;
  return time(*after) - stamp.toSec() < stamp.toSec() - time(*before) ? *after : *before;
}

bool InstrumentHistory::awaits(const ros::Time& stamp) const {
  if (all_.size() < 2 || stamp.isZero()) return false;
  double apart = 0.001;  // s: the trainer's
  const auto time = [](const auto& m) { return m->header.stamp.toSec(); };
  for (std::size_t k = all_.size() - 1; k > 0 && k + 8 > all_.size(); --k)
    apart = std::max(apart, time(all_[k]) - time(all_[k - 1]));
  const double missing = stamp.toSec() - time(all_.back());
  return missing > 0.8 * apart && missing < kStandsStill;
}

}  // namespace vest::displays

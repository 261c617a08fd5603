#pragma once

#include <deque>

#include <vest_msgs/InstrumentStates.h>

namespace vest::displays {

/// The last instruments messages, so that a picture shows the instruments as they were at the step of its
/// tissue: picture, keypoints and tf at the picture's stamp agree, and grasped tissue stays between the jaws.
class InstrumentHistory {
 public:
  static constexpr std::size_t kMost = 256;  ///< messages: a quarter of a second at the trainer's 1 kHz
  /// s: a state that is older than the newest instruments by more stands still (paused, or slower than real
  /// time), and the instruments go on without it. The states of the trainer are 17 ms apart (ours).
  static constexpr double kStandsStill = 0.1;

  /// A stamp before the newest one (a bag that jumped) starts anew.
  void add(const vest_msgs::InstrumentStates::ConstPtr& m);
  void clear() { all_.clear(); }
  /// The message nearest to the stamp of the tissue's state; the newest where the stamp is zero or the tissue
  /// stands still. Null while there is none.
  vest_msgs::InstrumentStates::ConstPtr at(const ros::Time& stamp) const;

 private:
  std::deque<vest_msgs::InstrumentStates::ConstPtr> all_;  ///< stamps do not decrease
};

}  // namespace vest::displays

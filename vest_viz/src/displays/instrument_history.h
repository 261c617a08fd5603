#pragma once

#include <deque>

#include <vest_msgs/InstrumentStates.h>

namespace vest::displays {

/// The last instruments messages, so that a picture shows the instruments as they were at the step of its
/// tissue: picture, keypoints and tf at the picture's stamp agree, and grasped tissue stays between the jaws.
class InstrumentHistory {
 public:
  static constexpr std::size_t kMost = 256;  ///< messages: a quarter of a second at the trainer's 1 kHz
  /// s: tissue of which no state came for longer stands still, if the newest instruments are later than its
  /// state by more: the instruments go on without it. The states of the trainer are 17 ms apart (assumed).
  static constexpr double kStandsStill = 0.1;

  /// A stamp before the newest one (a bag that jumped) starts anew.
  void add(const vest_msgs::InstrumentStates::ConstPtr& m);
  void clear() { all_.clear(); }
  /// The message nearest to the stamp of the tissue's state; the newest where the stamp is zero or the tissue
  /// stands still. Null while there is none. How late a state is does not tell that it stands still: a busy
  /// machine is late with all of them.
  /// @param age s since the state came
  vest_msgs::InstrumentStates::ConstPtr at(const ros::Time& stamp, double age) const;
  /// Whether the instruments of a state with this stamp are on their way: those known end before it by most
  /// of the time between two messages, but not by so much that they have ended.
  bool awaits(const ros::Time& stamp) const;

 private:
  std::deque<vest_msgs::InstrumentStates::ConstPtr> all_;  ///< stamps do not decrease
};

}  // namespace vest::displays

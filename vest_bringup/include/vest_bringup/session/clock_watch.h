#pragma once

#include <optional>
#include <vector>

namespace vest::session {

/// Sees when the system clock departs from the steady clock by a jump (it was set, or the machine slept), and
/// puts times of the system clock back on one line: that of the clock as it was before the first jump. All
/// times in s, of the system clock since 1970, of the steady clock since any one moment.
class ClockWatch {
 public:
  /// Jumps below it are the clock's own discipline. ntpd(8): offsets under 128 ms are slewed, others are set;
  /// a reading of both clocks is good to a hundredth of that.
  static constexpr double kJump = 0.1;

  struct Jump {
    double steady;  ///< when it was seen
    double by;      ///< system clock minus what it would have been
  };

  /// A reading of both clocks at one moment. @return the jump since the reading before, if there was one
  std::optional<Jump> look(double system, double steady);

  /// Look once after the stamp was taken, or a jump between the two is not known.
  /// @param stamp a time of the system clock @param steady a moment shortly after it
  double line(double stamp, double steady) const;

  const std::vector<Jump>& jumps() const { return jumps_; }

 private:
  bool begun_ = false;
  double offset_ = 0;                ///< system minus steady clock
  double total_ = 0;                 ///< of all jumps
  std::vector<double> totals_{0.0};  ///< of all jumps before the first, the second, …, and now
  std::vector<Jump> jumps_;
};

/// Both clocks at one moment: the steady one is read before and after, and a pair between which the thread
/// was put aside (more than 1 ms) is read again. Nothing after ten of them.
struct ClockReading {
  double system, steady;
};
std::optional<ClockReading> readClocks();

/// s of the steady clock.
double steadySeconds();

}  // namespace vest::session

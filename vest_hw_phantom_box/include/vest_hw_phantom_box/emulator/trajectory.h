// What a trainee's hands and feet do, as a table over time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "vest_hw_phantom_box/calibration/calibration.h"
#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::emulator {

using calibration::Error;

/// Positions of all joints (rad, m) and pedals at one time.
struct Pose {
  std::array<double, protocol::kJoints> joints{};
  std::uint8_t footswitches = 0;
  std::uint32_t invalid = 0;  ///< bit per joint: not measured
};

/// A pose in which instruments and endoscope rest inside the box (m, rad). The endoscope's 0.10 m is its
/// place in the demo. Its pitch of 0.30 lets a 30 degree optic look at the aim of its trocar: without it the
/// shaft points there, and the picture shows what lies before the pelvis. The other values are assumed.
Pose restPose();

enum class Interpolation { kLinear, kCubic };
enum class AtEnd { kHold, kLoop };

struct TrajectoryOptions {
  Interpolation interpolation = Interpolation::kLinear;
  AtEnd at_end = AtEnd::kHold;
  double max_gap =
      0.5;  ///< s; rows further apart than this are a drop-out: joints invalid in between, never bridged
};

struct Gap {
  double begin = 0;  ///< s
  double end = 0;    ///< s
};

/// Rows over time. `t_s` is taken relative to the first row. Joints between rows are interpolated (cubic:
/// Hermite with non-uniform three-point slopes, as Bessel's or parabolic splines, C. de Boor, A Practical
/// Guide to Splines, ch. IV; one-sided at ends and drop-outs). Footswitches change at rows. Loop: the first
/// row follows one row distance after the last. Where no hand gets there in that time, it takes the time of a
/// calm one, without pedals: a jump would be a fault of the sensor to the driver.
class Trajectory {
 public:
  /// Throws Error with file, line, column, value, allowed.
  static Trajectory load(const std::string& file, const TrajectoryOptions& options = {});
  static Trajectory parse(const std::string& text, const std::string& name,
                          const TrajectoryOptions& options = {});

  Pose at(double t_s) const;
  double duration() const { return times_.back(); }  ///< s
  std::size_t rows() const { return times_.size(); }
  const std::vector<Gap>& gaps() const { return gaps_; }

 private:
  void prepare();

  TrajectoryOptions options_;
  std::vector<double> times_;
  std::vector<std::array<double, protocol::kJoints>> joints_;
  std::vector<std::array<double, protocol::kJoints>> slopes_;
  std::vector<std::uint8_t> footswitches_;
  std::vector<Gap> gaps_;
  double period_ = 0;    ///< s, of a loop
  double way_back_ = 0;  ///< s from the last row to the first one; 0: one row distance, as the rows are
};

/// Slow, smooth movement of everything, and a pedal now and then: what is played without a file.
Pose defaultMotion(double t_s);

}  // namespace vest::emulator

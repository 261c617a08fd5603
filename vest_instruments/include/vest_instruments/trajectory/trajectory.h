#pragma once

#include <array>
#include <iosfwd>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::trajectory {

/// A motion or waypoint file that cannot be used; what() names file, line or field, value and what is
/// allowed.
class TrajectoryError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// One moment; instruments that the trajectory does not move are meaningless.
struct Row {
  double t = 0.0;  ///< s
  std::array<kinematics::JointPositions, tools::kInstrumentCount> joints;
  unsigned footswitches = 0;  ///< bit i: pedal i is down
};

/// What the emulator of the box plays.
struct Trajectory {
  std::array<bool, tools::kInstrumentCount> moves{};  ///< instruments with columns of their own
  bool has_footswitches = false;
  std::vector<Row> rows;  ///< times grow strictly
  /// What the hands hold at the start, where waypoints say so; not part of the CSV.
  std::array<std::optional<tools::ToolKind>, tools::kInstrumentCount> tools{};
  std::vector<tools::ToolKind> tool_tray;  ///< what the tool pedal hands over, press by press
  std::map<std::string, double>
      effects;                   ///< numbers of the session's effects by path: lens/start_temperature
  std::vector<double> pictures;  ///< s, growing: moments worth a picture; not part of the CSV
};

/// CSV: t_s, then NAME_yaw, NAME_pitch, NAME_insertion, NAME_roll, NAME_jaw (not for the endoscope) of each
/// instrument that moves, then footswitches (decimal bit mask) where there are any. rad, m.
void writeCsv(const Trajectory& trajectory, std::ostream& out);

/// A stretch without samples.
struct Gap {
  double from, to;  ///< s
};

/// How a recorded hand motion was laid into the box.
struct MotionReport {
  Trajectory trajectory;
  std::vector<Gap> gaps;
  double scale = 1.0;      ///< box metres per recorded metre
  double median_dt = 0.0;  ///< s
  Eigen::Vector3d centre;  ///< m, of the recorded positions' box, device axes turned to those of phantom_box
};

/// Maps recorded hand motion into an instrument's reach.
///
/// Input: CSV with a header that has t_s, px_mm, py_mm, pz_mm, qx, qy, qz, qw (others are passed over).
/// Device axes as OpenHaptics defines them: x right, y up, z towards the user; so in phantom_box x = px, y =
/// −pz, z = py. Position: the middle of the motion's bounding box goes to the trocar's aim point (moved up so
/// that the deepest point keeps 10 mm from the floor), with one scale for all axes, at most 1, such that the
/// motion fits ± (50, 50, 35) mm; the scale shrinks further until every row is reachable. Attitude: turned
/// from the first sample's, only the roll survives the trocar. Jaw: `jaw`, since a stylus has none. A step in
/// time of more than 5 times the median (and 0.1 s) is a gap: reported and kept, never bridged.
/// @throws TrajectoryError
MotionReport fromMotion(const std::string& path, const kinematics::TrainerBox& box,
                        tools::Instrument instrument, double jaw);

/// Scripted trainee: tip positions in world (= phantom_box) with times, joined by minimum-jerk motions that
/// rest at each waypoint, or pass it without a rest where it says `through`. Format: README.md. @throws
/// TrajectoryError, also for a point out of reach.
Trajectory fromWaypoints(const std::string& path, const kinematics::TrainerBox& box);

}  // namespace vest::trajectory

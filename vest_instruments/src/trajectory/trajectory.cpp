#include "vest_instruments/trajectory/trajectory.h"

#include <iomanip>
#include <ostream>

namespace vest::trajectory {

void writeCsv(const Trajectory& trajectory, std::ostream& out) {
  out << "t_s";
  for (std::size_t i = 0; i < trajectory.moves.size(); ++i) {
    if (!trajectory.moves[i]) continue;
    const auto instrument = static_cast<tools::Instrument>(i);
    const std::string_view name = tools::instrumentName(instrument);
    for (const char* joint : {"_yaw", "_pitch", "_insertion", "_roll"}) out << ',' << name << joint;
    out << ',' << name << (instrument == tools::Instrument::Endoscope ? "_light_post" : "_jaw");
  }
  if (trajectory.has_footswitches) out << ",footswitches";
  out << '\n' << std::fixed;
  for (const Row& row : trajectory.rows) {
    out << std::setprecision(6) << row.t;
    for (std::size_t i = 0; i < trajectory.moves.size(); ++i) {
      if (!trajectory.moves[i]) continue;
      const kinematics::JointPositions& q = row.joints[i];
      out << std::setprecision(8) << ',' << q.yaw << ',' << q.pitch << ',' << q.insertion << ',' << q.roll
          << ',' << q.jaw;
    }
    if (trajectory.has_footswitches) out << ',' << row.footswitches;
    out << '\n';
  }
}

}  // namespace vest::trajectory

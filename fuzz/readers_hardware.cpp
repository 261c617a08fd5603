#include <sstream>

#include "readers.h"
#include "vest_hw_phantom_box/calibration/calibration.h"
#include "vest_hw_phantom_box/emulator/trajectory.h"
#include "vest_hw_phantom_box/events/event_source.h"
#include "vest_hw_phantom_box/transport/raw_log.h"
#include "vest_instruments/control/input_map.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/trajectory/trajectory.h"
#include "vest_instruments/urdf/description.h"

namespace vest::fuzz {
namespace {

std::vector<std::string> rawLogs() {
  const Folder one;
  const std::string file = one.path() + "/raw.log";
  {
    transport::RawLog log;
    log.open(file);
    const std::vector<std::uint8_t> piece{0x56, 0x53, 0, 1, 2, 3, 0xff};
    for (int i = 0; i < 4; ++i)
      log.write(1000000 * i, piece.data(), piece.size() - static_cast<std::size_t>(i));
  }
  return {files::read(file, 1 << 20)};
}

}  // namespace

std::vector<Reader> hardwareReaders() {
  static Folder folder;
  const auto written = [](const std::string& name, const std::string& input) {
    folder.clear();
    return folder.write(name, input);
  };
  static const kinematics::TrainerBox box =
      kinematics::loadTrainerBox(std::string(VEST_SOURCE_DIR) + "/vest_instruments/config/trainer_box.yaml");
  return {
      {"trainer_box",
       [=](const std::string& input) {
         const std::string file = written("box.yaml", input);
         takes(file, [&] { kinematics::loadTrainerBox(file); });
       },
       shipped("vest_instruments/config/trainer_box.yaml")},
      {"input_map",
       [=](const std::string& input) {
         const std::string file = written("inputs.yaml", input);
         takes(file, [&] { control::loadInputMap(file); });
       },
       shipped("vest_instruments/config/inputs.yaml", "vest_hw_phantom_box/test/data/inputs.yaml")},
      {"waypoints",
       [=](const std::string& input) {
         const std::string file = written("waypoints.yaml", input);
         takes(file, [&] {
           std::ostringstream out;
           const auto trajectory = trajectory::fromWaypoints(file, box);
           if (trajectory.rows.size() < 10000) trajectory::writeCsv(trajectory, out);
         });
       },
       {}},
      {"motion",
       [=](const std::string& input) {
         const std::string file = written("motion.csv", input);
         takes(file, [&] { trajectory::fromMotion(file, box, tools::Instrument::Left, 0.3); });
       },
       {}},
      {"urdf", [](const std::string& input) { takes("", [&] { urdf::checkUrdf(input); }); }, {}},
      {"calibration",
       [=](const std::string& input) {
         const std::string file = written("calibration.yaml", input);
         takes(file, [&] { calibration::loadCalibration(file); });
       },
       shipped("vest_hw_phantom_box/config/default.yaml")},
      {"trajectory",
       [=](const std::string& input) {
         const std::string file = written("trajectory.csv", input);
         takes(file, [&] {
           emulator::TrajectoryOptions options;
           options.interpolation = emulator::Interpolation::kCubic;
           options.at_end = emulator::AtEnd::kLoop;
           const auto read = emulator::Trajectory::load(file, options);
           for (const double t : {-1.0, 0.0, 0.37, 12.0, 1e9}) read.at(t);
         });
       },
       {}},
      {"raw_log",
       [=](const std::string& input) {
         const std::string file = written("raw.log", input);
         takes(file, [&] { transport::readRawLog(file); });
       },
       rawLogs},
      {"events",
       [=](const std::string& input) {
         const std::string file = written("events.csv", input);
         takes(file, [&] {
           const auto source = events::openRecording(file);
           events::Event event;
           for (int i = 0; i < 100; ++i) source->next(event, 0.1 * i);
         });
       },
       {}},
  };
}

}  // namespace vest::fuzz

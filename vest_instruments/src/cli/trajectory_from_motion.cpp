// Recorded hand motion to a trajectory that the emulator of the box plays.
#include <fstream>
#include <iostream>
#include <string>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/trajectory/trajectory.h"

int main(int argc, char** argv) {
  CLI::App app{"Maps recorded hand motion (CSV) into an instrument's reach in the box"};
  std::string motion, output,
      box_file = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml", name = "left";
  double jaw = 0.3;
  app.add_option("motion", motion, "CSV with t_s, px_mm, py_mm, pz_mm, qx, qy, qz, qw")->required();
  app.add_option("--instrument", name, "left, right, third or endoscope")
      ->capture_default_str()
      ->check(CLI::IsMember({"left", "right", "third", "endoscope"}));
  app.add_option("--output", output, "trajectory CSV to write")->required();
  app.add_option("--box", box_file, "layout of the box")->capture_default_str();
  app.add_option("--jaw", jaw, "opening of the jaws, rad: a stylus has none")
      ->capture_default_str()
      ->check(vest::files::number(0, 1.2));
  CLI11_PARSE(app, argc, argv);
  try {
    const auto box = vest::kinematics::loadTrainerBox(box_file);
    auto instrument = vest::tools::Instrument::Left;
    for (int i = 0; i < vest::tools::kInstrumentCount; ++i) {
      const auto candidate = static_cast<vest::tools::Instrument>(i);
      if (vest::tools::instrumentName(candidate) == name) instrument = candidate;
    }
    const auto report = vest::trajectory::fromMotion(motion, box, instrument, jaw);
    std::ofstream out(output);
    vest::trajectory::writeCsv(report.trajectory, out);
    if (!out.flush()) throw std::runtime_error(output + ": cannot be written");
    std::cout << report.trajectory.rows.size() << " rows, " << report.trajectory.rows.back().t
              << " s, all reachable; scale " << report.scale << ", median step " << 1e3 * report.median_dt
              << " ms\n";
    for (const auto& gap : report.gaps) {
      std::cout << "gap: no samples from " << gap.from << " s to " << gap.to << " s (" << gap.to - gap.from
                << " s), kept\n";
    }
  } catch (const std::exception& e) {
    std::cerr << "trajectory_from_motion: " << vest::files::shown(e.what(), 6000) << "\n";
    return 1;
  }
  return 0;
}

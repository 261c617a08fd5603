// A scripted trainee, written as tip positions, to a trajectory that the emulator of the box plays.
#include <fstream>
#include <iostream>
#include <string>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_instruments/files/read.h"
#include "vest_instruments/trajectory/trajectory.h"

int main(int argc, char** argv) {
  CLI::App app{"Turns waypoints of the instruments' tips (YAML) into a trajectory of joints (CSV)"};
  std::string waypoints, output,
      box_file = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml";
  app.add_option("waypoints", waypoints, "YAML; the format stands in the package's README")->required();
  app.add_option("--output", output, "trajectory CSV to write")->required();
  app.add_option("--box", box_file, "layout of the box")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto trajectory =
        vest::trajectory::fromWaypoints(waypoints, vest::kinematics::loadTrainerBox(box_file));
    std::ofstream out(output);
    vest::trajectory::writeCsv(trajectory, out);
    if (!out.flush()) throw std::runtime_error(output + ": cannot be written");
    std::cout << trajectory.rows.size() << " rows, " << trajectory.rows.back().t << " s\n";
  } catch (const std::exception& e) {
    std::cerr << "trajectory_from_waypoints: " << vest::files::shown(e.what(), 6000) << "\n";
    return 1;
  }
  return 0;
}

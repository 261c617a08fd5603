#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "vest_bringup/session/motion_metrics.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"

// Figures of motion from anybody's recordings of tools.
int main(int argc, char** argv) {
  CLI::App app{
      "Computes figures of motion (path, speed, smoothness, idle time, use of both hands) of a table of tool "
      "positions.\nColumns: t_s, and for each tool NAME_x_m, NAME_y_m, NAME_z_m; optional NAME_qx, NAME_qy, "
      "NAME_qz, "
      "NAME_qw, NAME_jaw_rad.\nFor other tables say --columns. Exit code: 0, or 1 for a table that is "
      "refused."};
  std::string file, columns;
  std::string unit = "m", time_unit = "s";
  std::vector<std::string> others;
  vest::session::MotionLayout layout;
  bool json = false;
  const std::map<std::string, double> units{{"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}},
      time_units{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
  app.add_option("TABLE", file, "recording (CSV, or columns separated by blanks)")->required();
  app.add_flag("--json", json, "print JSON");
  app.add_option(
      "--columns", columns,
      "columns of a table without our header, counted from 1: left=2-4,right=9-11; seven columns: x y z qx "
      "qy qz qw");
  auto* const time =
      app.add_option("--time", layout.time_column, "column of the time, counted from 1 (with --columns)")
          ->check(CLI::Range(1, 1000));
  app.add_option("--time_unit", time_unit, "unit of the column of --time: s, ms, us, ns (stamps of ROS)")
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}))
      ->needs(time);
  app.add_option("--rate", layout.rate, "Hz, where there is no time column")
      ->check(vest::files::number(0.1, 1e5));
  app.add_option("--unit", unit, "unit of positions: m, cm, mm")->check(CLI::IsMember({"m", "cm", "mm"}));
  app.add_option("--cohort", others, "further recordings of the same layout: prints each one's motion index");
  CLI11_PARSE(app, argc, argv);
  try {
    layout.metres_per_unit = units.at(unit), layout.seconds_per_unit = time_units.at(time_unit);
    if (!columns.empty()) layout.tools = vest::session::parseColumns(columns);
    if (columns.empty() && layout.time_column > 0)
      throw std::invalid_argument("--time: only with --columns (allowed otherwise: a column t_s)");
    const auto figures = vest::session::motion::figuresOf(vest::session::readMotionTable(file, layout));
    std::vector<vest::session::motion::Figures> cohort;
    for (const std::string& other : others)
      cohort.push_back(vest::session::motion::figuresOf(vest::session::readMotionTable(other, layout)));
    const std::string text = json ? vest::session::motion::toJson(figures, cohort)
                                  : vest::session::motion::toText(figures, cohort);
    std::fputs(text.c_str(), stdout);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_metrics: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  }
  return 0;
}

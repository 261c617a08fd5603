// The calibration file of a real endoscope's camera, from pictures of a chessboard.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include <CLI/CLI.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/refusal.h"
#include "vest_instruments/files/replace.h"
#include "vest_viz/camera/board.h"
#include "vest_viz/picture/read.h"

namespace {

/// The calibration takes its place where the view would take it.
void write(const vest::camera::Intrinsics& camera, const std::string& output) {
  const std::string part = output + ".new";
  try {
    std::ofstream out = vest::files::replacing(part);
    out << vest::camera::toYaml(camera, "endoscope");
    out.close();
    if (!out) throw std::runtime_error("cannot be written");
    vest::camera::readCalibration(part);
    std::filesystem::rename(part, output);
  } catch (const std::exception& e) {
    std::error_code none;
    std::filesystem::remove(part, none);
    throw std::runtime_error("--output " + vest::files::refusal(e.what(), output));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Calibrates an endoscope's camera from pictures of a chessboard (vest_viz/README.md)"};
  std::vector<std::string> files;
  std::string output;
  vest::camera::Board board;
  double square_mm = 1e3 * board.square;
  app.add_option("pictures", files,
                 "PNG or JPEG files, all of one size; ten or more, tilted up to 40 degrees every way")
      ->required();
  app.add_option("--columns", board.columns, "squares of a row")
      ->check(CLI::Range(4, 100))
      ->capture_default_str();
  app.add_option("--rows", board.rows, "rows of squares")->check(CLI::Range(4, 100))->capture_default_str();
  app.add_option("--square", square_mm, "edge of a square, mm")
      ->check(vest::files::number(0.1, 1000))
      ->capture_default_str();
  app.add_option("--output", output,
                 "YAML file: the view's Calibration File, and that of ROS's camera drivers")
      ->required();
  CLI11_PARSE(app, argc, argv);
  board.square = 1e-3 * square_mm;
  try {
    std::vector<cv::Mat> pictures;
    for (const std::string& file : files) {
      pictures.push_back(vest::picture::read(file, cv::IMREAD_GRAYSCALE));
      try {
        vest::camera::checkSize(pictures.back(), pictures.front());
      } catch (const std::exception& e) {
        throw std::runtime_error(vest::files::refusal(e.what(), file));
      }
    }
    vest::camera::BoardCalibration found;
    try {
      found = vest::camera::calibrate(pictures, board);
    } catch (const std::exception& e) {  // of all of them
      throw std::runtime_error(vest::files::refusal(e.what(), files.front() + ", and those after it"));
    }
    for (std::size_t i = 0; i < files.size(); ++i)
      if (!found.found[i]) std::printf("board not found in %s\n", vest::files::shown(files[i], 6000).c_str());
    const auto& c = found.camera;
    std::printf(
        "fx %.2f fy %.2f cx %.2f cy %.2f k1 %.4f k2 %.4f; corners met within %.3f pixels in %zu of %zu "
        "pictures\n",
        c.fx, c.fy, c.cx, c.cy, c.distortion[0], c.distortion[1], found.error, found.corners.size(),
        files.size());
    if (found.error > 1.0)
      std::printf("more than a pixel: is --columns, --rows right, and is the board flat?\n");
    write(c, output);
    std::printf("written: %s\n", vest::files::shown(output, 6000).c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_calibrate_camera: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  }
  return 0;
}

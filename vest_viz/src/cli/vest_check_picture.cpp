// Measures a picture of the endoscopic view against figures of real laparoscopies.
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vest_instruments/files/option.h"
#include "vest_instruments/files/refusal.h"
#include "vest_viz/picture/check.h"
#include "vest_viz/picture/read.h"

int main(int argc, char** argv) {
  CLI::App app{
      "Measures the round image of PICTURE against figures of real laparoscopies "
      "(vest_viz/docs/pictures.md).\n"
      "Exit status: 0 all inside, 1 some outside, 2 the picture cannot be read."};
  std::string path;
  std::vector<double> circle_values;
  app.add_option("picture", path, "PNG or JPEG of at most 9 megapixels")->required();
  app.add_option("--circle", circle_values, "centre x, y and radius in pixels; found by itself if not given")
      ->expected(3)
      ->check(vest::files::number(-1e5, 1e5));
  CLI11_PARSE(app, argc, argv);
  try {
    constexpr int kMost = 9;  // megapixels, room for 4096 x 2160: each takes 60 MB while it is measured
    const cv::Mat picture = vest::picture::read(path, cv::IMREAD_COLOR, kMost);
    vest::picture::Circle circle;
    if (circle_values.empty())
      circle = vest::picture::findCircle(picture);
    else
      circle = {circle_values[0], circle_values[1], circle_values[2]};
    const auto rows = vest::picture::checkPicture(picture, circle);
    std::printf("%s: %d x %d, circle %.0f %.0f %.0f\n%s", vest::files::shown(path, 6000).c_str(),
                picture.cols, picture.rows, circle.cx, circle.cy, circle.radius,
                vest::picture::format(rows).c_str());
    return vest::picture::allInside(rows) ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_check_picture: %s\n", vest::files::refusal(e.what(), path).c_str());
    return 2;
  }
}

// What a picture of a volume costs: time on the wall and of all threads, for the picture while something
// moves and for that at rest, and a slice.
#include <chrono>
#include <cstdio>
#include <ctime>
#include <string>
#include <thread>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <opencv2/imgcodecs.hpp>

#include "vest_tissue/image/brick.h"
#include "vest_viz/volume/ray_caster.h"
#include "vest_viz/volume/section.h"

using namespace vest::volume;
using Eigen::Vector3d;

namespace {

double wall() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A camera 2.2 radii from the middle, 50 degrees wide, that looks from the front, the right and above.
Eigen::Matrix4d camera(const Brick& brick, double aspect, double around) {
  const Vector3d low = brick.origin, far = brick.axes * Vector3d(brick.size[0], brick.size[1], brick.size[2]);
  const double distance = 1.1 * far.norm(), near = 0.01, end = 10, tall = std::tan(25 * M_PI / 180);
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(around, Vector3d::UnitZ()) * Eigen::AngleAxisd(70 * M_PI / 180, Vector3d::UnitX()))
          .toRotationMatrix();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = turn;
  pose.translation() = low + 0.5 * far + turn * Vector3d(0, 0, distance);
  Eigen::Matrix4d p = Eigen::Matrix4d::Zero();
  p(0, 0) = 1 / (tall * aspect), p(1, 1) = 1 / tall;
  p(2, 2) = -(end + near) / (end - near), p(2, 3) = -2 * end * near / (end - near), p(3, 2) = -1;
  return pose.matrix() * p.inverse();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times pictures of a volume.");
  std::string path, output, table;
  int threads = static_cast<int>(std::thread::hardware_concurrency());
  app.add_option("PATH", path, "as vest_image takes it")->required();
  app.add_option("TABLE", table, "file of vest_tissue/library/tables")->required();
  app.add_option("--threads", threads, "that draw");
  app.add_option("--output", output, "PNG of the picture at rest");
  CLI11_PARSE(app, argc, argv);
  const auto brick = std::make_shared<Brick>(vest::image::toBrick(vest::image::read(path), Vector3d::Zero()));
  RayCaster caster(brick);
  double begin = wall();
  caster.setTable(readTransferTable(table));
  std::printf("table           %7.1f ms\n", 1e3 * (wall() - begin));
  vest::solver::Pool pool(threads);
  const double voxel = brick->axes.colwise().norm().minCoeff();
  std::vector<std::uint8_t> rgba;
  for (const auto& [width, height, step] : {std::tuple{180, 144, 1.5}, {360, 288, 1.5}, {720, 576, 0.5}}) {
    begin = wall();
    const std::clock_t cpu = std::clock();
    const int views = width < 720 ? 8 : 1;
    for (int v = 0; v < views; ++v)
      caster.cast({width, height, camera(*brick, 1.0 * width / height, 0.6 + 0.3 * v)},
                  {step * voxel, true, {}}, pool, &rgba);
    std::printf("%3d x %3d       %7.1f ms, %7.1f ms of all threads\n", width, height,
                1e3 * (wall() - begin) / views,
                1e3 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC / views);
    if (width == 720 && !output.empty()) {
      cv::Mat picture(height, width, CV_8UC3);
      for (int p = 0; p < width * height; ++p)
        for (int c = 0; c < 3; ++c)
          picture.data[3 * p + 2 - c] =
              static_cast<std::uint8_t>(rgba[4 * p + c] + (255 - rgba[4 * p + 3]) * 40 / 255);
      cv::imwrite(output, picture);
    }
  }
  const Vector3d middle =
      brick->origin + 0.5 * brick->axes * Vector3d(brick->size[0], brick->size[1], brick->size[2]);
  const Eigen::Vector3f normal = Eigen::Vector3f(0.6f, -0.48f, 0.64f);
  begin = wall();
  const Section s = section(*brick, {normal, normal.dot(middle.cast<float>())}, {});
  std::printf("slice %3d x %3d %7.1f ms\n", s.width, s.height, 1e3 * (wall() - begin));
  return 0;
}

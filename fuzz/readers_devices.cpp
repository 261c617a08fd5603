#include <stdexcept>

#include <opencv2/imgcodecs.hpp>

#include "readers.h"
#include "vest_haptics/device/device.h"
#include "vest_haptics/device/replay.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/refusal.h"
#include "vest_viz/camera/model.h"
#include "vest_viz/instrument/stl.h"
#include "vest_viz/picture/check.h"
#include "vest_viz/picture/read.h"

namespace vest::fuzz {
namespace {

/// A round image on black, as both kinds of file.
std::vector<std::string> pictures() {
  cv::Mat picture = cv::Mat::zeros(48, 64, CV_8UC3);
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.cols; ++column)
      if ((row - 24) * (row - 24) + (column - 32) * (column - 32) < 22 * 22)
        picture.at<cv::Vec3b>(row, column) = {static_cast<std::uint8_t>(3 * column), 90, 160};
  std::vector<std::string> made;
  for (const auto& [ending, how] :
       {std::pair(".png", std::vector<int>{}), std::pair(".jpg", std::vector<int>{}),
        std::pair(".jpg",
                  std::vector<int>{cv::IMWRITE_JPEG_PROGRESSIVE, 1, cv::IMWRITE_JPEG_RST_INTERVAL, 2})}) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(ending, picture, bytes, how);
    made.emplace_back(bytes.begin(), bytes.end());
  }
  return made;
}

}  // namespace

std::vector<Reader> deviceReaders() {
  static Folder folder;
  const auto written = [](const std::string& name, const std::string& input) {
    folder.clear();
    return folder.write(name, input);
  };
  return {
      {"haptic_motion",
       [=](const std::string& input) {
         const std::string file = written("motion.csv", input);
         takes(file, [&] {
           haptics::ReplayDevice device;
           device.open({{"file", file}});
           haptics::Sample sample;
           for (int i = 0; i < 100; ++i) device.read(sample);
         });
       },
       {}},
      {"camera",
       [=](const std::string& input) {
         const std::string file = written("camera.yaml", input);
         takes(file, [&] { camera::readCalibration(file); });
       },
       {}},
      {"instrument",
       [=](const std::string& input) {
         const std::string file = written("shaft.stl", input);
         takes(file, [&] { instrument::readStl(file, 0.6); });
       },
       shipped("vest_instruments/meshes/injection_needle_fixed.stl")},
      {"picture",
       [=](const std::string& input) {
         const std::string file = written("picture", input);
         cv::Mat read;
         if (!takes(file, [&] { read = picture::read(file, cv::IMREAD_COLOR, 9); })) return;
         if (read.total() >= 1 << 16) return;
         takes(file, [&] {
           try {
             picture::checkPicture(read, picture::findCircle(read));
           } catch (const std::exception& error) {  // as vest_check_picture does
             throw std::invalid_argument(files::refusal(error.what(), file));
           }
         });
       },
       pictures},
  };
}

}  // namespace vest::fuzz

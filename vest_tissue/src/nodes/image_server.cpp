// Publishes a patient's image for displays; the node behind show_image.launch.
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/ros.h>
#include <vest_msgs/ImageVolume.h>
#include <CLI/CLI.hpp>

#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/image/brick.h"
#include "vest_tissue/ros/conversions.h"

namespace {

vest_msgs::ImageVolume toMessage(const vest::image::Volume& volume, const Eigen::Vector3d& place) {
  vest_msgs::ImageVolume m;
  vest::ros_shell::toMsg(vest::image::toBrick(volume, place), m);
  m.modality = volume.modality;
  m.hash = vest::image::hash(volume);
  return m;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "image_server");
  CLI::App app("Publishes a patient's image as image/volume (vest_msgs/ImageVolume, latched), lying supine.");
  std::string path;
  vest::image::ReadOptions options;
  std::vector<double> place{0, 0.05, 0.03};  // as in patient.yaml
  app.add_option("PATH", path, "folder or file of DICOM, or a file of NRRD, MetaImage or NIfTI")->required();
  app.add_option("--series", options.series, "which of several series: its number in the list, or its UID");
  app.add_flag("--resample", options.resample, "interpolate what is uneven or tilted");
  app.add_option("--place", place, "X Y Z, m, world: where the middle of the underside comes to lie")
      ->expected(3)
      ->check(vest::files::number(-10, 10))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    vest_msgs::ImageVolume message;
    {
      // Before the first handle: reading forks, and a handle starts threads.
      const vest::image::Volume volume = vest::image::read(path, options);
      for (const auto& note : volume.notes)
        std::fprintf(stderr, "image_server: note: %s\n", vest::files::shown(note, 1000).c_str());
      message = toMessage(volume, {place[0], place[1], place[2]});
    }
    const std::filesystem::path absolute = std::filesystem::absolute(path).lexically_normal();
    message.name = vest::files::shown(
        (absolute.has_filename() ? absolute : absolute.parent_path()).filename().string(), 200);
    ros::NodeHandle handle;
    message.header.stamp = ros::Time::now();
    const ros::Publisher publisher = handle.advertise<vest_msgs::ImageVolume>("image/volume", 1, true);
    publisher.publish(message);
    ROS_INFO("image_server: %s: %u x %u x %u voxels on %s", message.name.c_str(), message.size[0],
             message.size[1], message.size[2], publisher.getTopic().c_str());
    message = {};
    ros::spin();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "image_server: %s\n", vest::files::shown(error.what(), 2000).c_str());
    return 1;
  }
}

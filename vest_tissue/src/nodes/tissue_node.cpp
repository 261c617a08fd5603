#include <ros/ros.h>

#include "vest_tissue/ros/tissue_server.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "tissue");
  ros::NodeHandle keep;  // the last handle ends ROS, and with it the log that carries a refusal
  try {
    vest::ros_shell::TissueServer server(
        ros::NodeHandle(), ros::NodeHandle("~"), [](vest::scene::World world) {
          return std::make_unique<vest::scene::TissueSimulation>(std::move(world));
        });
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("tissue_node: %s", e.what());
    return 1;
  }
  return 0;
}

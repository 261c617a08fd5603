#include <cstdio>

#include <ros/ros.h>

#include "vest_instruments/ros/node_help.h"
#include "vest_tissue/ros/tissue_server.h"

int main(int argc, char** argv) {
  if (vest::ros_shell::answeredHelp(
          argc, argv,
          "usage: rosrun vest_tissue tissue_node [_scene:=gynaecology] [_threads:=1] [_PARAMETER:=VALUE …]\n"
          "The tissue of a scene, without effects; the node behind tissue.launch.\n"
          "Parameters and topics: README.md of vest_tissue."))
    return 0;
  ros::init(argc, argv, "tissue");
  std::unique_ptr<vest::shared::SessionLock> alone;
  try {
    alone = vest::ros_shell::TissueServer::holdSession(ros::this_node::getNamespace());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "tissue_node: %s\n", e.what());
    return 1;
  }
  ros::NodeHandle keep;  // the last handle ends ROS, and with it the log that carries a refusal
  try {
    vest::ros_shell::TissueServer server(
        ros::NodeHandle(), ros::NodeHandle("~"),
        [](vest::scene::World world) {
          return std::make_unique<vest::scene::TissueSimulation>(std::move(world));
        },
        {}, std::move(alone));
    ros::spin();
  } catch (const std::exception& e) {
    ROS_FATAL("tissue_node: %s", e.what());
    return 1;
  }
  return 0;
}

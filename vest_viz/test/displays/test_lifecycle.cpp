// Adds and removes displays at run time, in a visualization manager of this process, and counts OGRE's
// resources.
#include <map>
#include <memory>
#include <string>

#include <OgreMaterialManager.h>
#include <OgreMeshManager.h>
#include <OgreTextureManager.h>
#include <gtest/gtest.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/display.h>
#include <rviz/render_panel.h>
#include <rviz/visualization_manager.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/TissueTopology.h>
#include <QApplication>

#include "scene_messages.h"

namespace {

using vest::tools::Place;

/// Number of OGRE resources per kind that bear our name.
std::map<std::string, int> ownResources() {
  std::map<std::string, int> count;
  const auto add = [&](const char* kind, Ogre::ResourceManager& manager) {
    count[kind] = 0;
    auto all = manager.getResourceIterator();
    while (all.hasMoreElements())
      if (all.getNext()->getName().rfind("vest_viz/", 0) == 0) ++count[kind];
  };
  add("materials", Ogre::MaterialManager::getSingleton());
  add("meshes", Ogre::MeshManager::getSingleton());
  add("textures", Ogre::TextureManager::getSingleton());
  return count;
}

TEST(DisplayLifecycle, TenTimesAddedAndRemovedLeavesNoResourceBehind) {
  ros::NodeHandle handle;
  auto topology = handle.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  auto instruments = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1, true);
  topology.publish(vest::tools::topologyOf(
      vest::scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml")));
  vest_msgs::InstrumentStates states;
  states.instruments = {vest::tools::instrumentAt(Place::Left, {-0.03, 0.05, 0.07}, 0, 0.1),
                        vest::tools::instrumentAt(Place::Endoscope, vest::tools::endoscopeTip(0.1), 0, 0)};
  instruments.publish(states);

  rviz::RenderPanel panel;
  rviz::VisualizationManager manager(&panel);
  panel.initialize(manager.getSceneManager(), &manager);
  manager.initialize();
  manager.setFixedFrame("world");
  manager.startUpdate();
  std::map<std::string, int> first;
  for (int round = 0; round < 10; ++round) {
    rviz::Display* view = manager.createDisplay("vest_viz/EndoscopicView", "view", true);
    rviz::Display* tissue = manager.createDisplay("vest_viz/Tissue", "tissue", true);
    ASSERT_NE(view, nullptr);
    ASSERT_NE(tissue, nullptr);
    tissue->subProp("Links")->setValue(true);
    // Until the topology has arrived: then each object has a mesh and a material in both displays.
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(20);
    while (ownResources()["meshes"] < 30 && ros::WallTime::now() < end) {
      QApplication::processEvents();
      ros::spinOnce();
      ros::WallDuration(0.01).sleep();
    }
    ASSERT_GE(ownResources()["meshes"], 30) << "round " << round;
    for (int k = 0; k < 5; ++k) QApplication::processEvents();
    delete view;
    delete tissue;
    QApplication::processEvents();
    if (round == 0) first = ownResources();
    EXPECT_EQ(ownResources(), first) << "round " << round;
  }
  EXPECT_EQ(first["meshes"], 0);
  manager.stopUpdate();
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_lifecycle");
  QApplication application(argc, argv);
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}

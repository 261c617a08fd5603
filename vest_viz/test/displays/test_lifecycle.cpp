// Adds and removes displays at run time, in a visualization manager of this process, and counts OGRE's
// resources.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <OgreMaterialManager.h>
#include <OgreMeshManager.h>
#include <OgreTextureManager.h>
#include <gtest/gtest.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <rviz/display.h>
#include <rviz/render_panel.h>
#include <rviz/visualization_manager.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/FluidState.h>
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

TEST(DisplayLifecycle, AddedAndRemovedAgainAndAgainLeavesNoResourceBehind) {
  ros::NodeHandle handle;
  auto topology = handle.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  auto instruments = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1, true);
  topology.publish(vest::tools::topologyOf(
      vest::scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml")));
  vest_msgs::InstrumentStates states;
  states.instruments = {vest::tools::instrumentAt(Place::Left, {-0.03, 0.05, 0.07}, 0, 0.1),
                        vest::tools::instrumentAt(Place::Endoscope, vest::tools::endoscopeTip(0.1), 0, 0)};
  instruments.publish(states);
  // Effects and contacts that are not finite are left out.
  auto fluid = handle.advertise<vest_msgs::FluidState>("effects/fluid", 1, true);
  vest_msgs::FluidState drops;
  drops.particle_radius = 0.001f;
  drops.positions = {0, 0, 0.05f, std::nanf(""), 0, 0, 1};
  drops.pools.resize(1);
  drops.pools[0].columns = 4000000000u;
  fluid.publish(drops);
  auto contacts = handle.advertise<vest_msgs::ContactModels>("tissue/contacts", 1, true);
  vest_msgs::ContactModels forces;
  forces.contacts.resize(2);
  forces.contacts[0].in_contact = forces.contacts[1].in_contact = true;
  forces.contacts[0].proxy.orientation.w = 1;
  forces.contacts[0].wrench.force.z = 2;
  forces.contacts[1].wrench.force.z = std::nan("");
  contacts.publish(forces);

  rviz::RenderPanel panel;
  rviz::VisualizationManager manager(&panel);
  panel.initialize(manager.getSceneManager(), &manager);
  manager.initialize();
  manager.setFixedFrame("world");
  manager.startUpdate();
  std::map<std::string, int> first;
  const int rounds = std::getenv("VEST_FULL") != nullptr ? 100 : 8;
  std::printf("count: %d of 100 rounds of all displays\n", rounds);
  for (int round = 0; round < rounds; ++round) {
    rviz::Display* view = manager.createDisplay("vest_viz/EndoscopicView", "view", true);
    rviz::Display* tissue = manager.createDisplay("vest_viz/Tissue", "tissue", true);
    // Two of each at once.
    std::vector<rviz::Display*> others;
    for (const char* kind : {"vest_viz/Tissue", "vest_viz/Contacts", "vest_viz/Contacts", "vest_viz/Effects",
                             "vest_viz/Effects"}) {
      others.push_back(manager.createDisplay(kind, "other", true));
      ASSERT_NE(others.back(), nullptr) << kind;
    }
    ASSERT_NE(view, nullptr);
    ASSERT_NE(tissue, nullptr);
    tissue->subProp("Links")->setValue(true);
    others[0]->subProp("Colour By")->setValue(round % 2 == 0 ? "strain" : "material");
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
    for (rviz::Display* other : others) delete other;
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

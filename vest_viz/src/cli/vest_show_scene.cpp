// Publishes a scene file's topology, a gently moved state and instruments, without any simulation: to look at
// a scene, and for the benchmark and the tests of the displays.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>

#include <ros/package.h>
#include <ros/ros.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <CLI/CLI.hpp>

#include "effect_messages.h"
#include "scene_messages.h"
#include "vest_instruments/files/option.h"
#include "vest_tissue/scene/world.h"

using Eigen::Vector3d;
namespace tools = vest::tools;

int main(int argc, char** argv) {
  ros::init(argc, argv, "vest_show_scene");
  CLI::App app{
      "Publishes tissue/topology, tissue/state and instruments for a scene file, without simulation."};
  std::string path, effects;
  double rate = 60, insertion = 0.10, seconds = 0;
  std::vector<double> view;
  bool still = false;
  app.add_option("scene", path, "scene file; default: the gynaecology scene of vest_tissue");
  app.add_option("--rate", rate, "states per second")->check(vest::files::number(0.1, 1000));
  app.add_option("--insertion", insertion, "of the endoscope, m")->check(vest::files::number(0, 0.28));
  app.add_option("--view", view, "endoscope tip x y z, m, in world")
      ->expected(3)
      ->check(vest::files::number(-10, 10));
  app.add_option("--seconds", seconds, "ends after so long; 0: runs on")->check(vest::files::number(0, 1e9));
  app.add_flag("--still", still, "nothing moves");
  app.add_option("--effects", effects,
                 "made-up effects: all, or some of fields,cut,clips,sutures,fluid,smoke,lens,monitor");
  CLI11_PARSE(app, argc, argv);
  std::set<std::string> words;
  if (path.empty()) path = ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml";
  vest::scene::Description scene;
  try {
    scene = vest::scene::loadScene(path);
    words = tools::effectWords(effects);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  ros::NodeHandle handle;
  ros::Publisher topology_pub = handle.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  ros::Publisher state_pub = handle.advertise<vest_msgs::TissueState>("tissue/state", 1);
  ros::Publisher instruments_pub = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1);
  vest_msgs::TissueTopology topology = tools::topologyOf(scene);
  if (words.count("cut") != 0) tools::addCut(&topology);
  topology_pub.publish(topology);
  ros::Publisher attachments_pub = handle.advertise<vest_msgs::TissueAttachments>("tissue/attachments", 1);
  ros::Publisher sutures_pub = handle.advertise<vest_msgs::SutureStates>("tissue/sutures", 1);
  ros::Publisher fluid_pub = handle.advertise<vest_msgs::FluidState>("effects/fluid", 1);
  ros::Publisher smoke_pub = handle.advertise<vest_msgs::SmokeState>("effects/smoke", 1);
  ros::Publisher lens_pub = handle.advertise<vest_msgs::LensState>("effects/lens", 1);
  ros::Publisher monitor_pub = handle.advertise<vest_msgs::HaemodynamicsState>("effects/haemodynamics", 1);
  // Effects at about 30 Hz, fields and lens at about 6 Hz, as the trainer sends them.
  const auto few = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rate / 30));
  const auto fewer = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(rate / 6));

  // Where the grasper holds: the left tube's isthmus.
  Vector3d held(-0.035, 0.05, 0.06);
  double nearest = 1e9;
  for (const auto& o : scene.objects)
    for (const Vector3d& p : o.position)
      if (o.name == "tube_left" && std::fabs(p.x() + 0.035) < nearest) {
        nearest = std::fabs(p.x() + 0.035);
        held = p;
      }
  ros::Rate pace(rate);
  const ros::SteadyTime start = ros::SteadyTime::now();
  for (std::uint64_t n = 0; ros::ok(); ++n) {
    const double t = still ? 2.0 : static_cast<double>(n) / rate;
    if (seconds > 0 && (ros::SteadyTime::now() - start).toSec() > seconds) break;
    const double lift = 0.5 - 0.5 * std::cos(t * 1.2);
    const Vector3d pull = lift * Vector3d(-0.005, -0.012, 0.022);
    vest_msgs::TissueState state;
    state.header.stamp = ros::Time::now();
    state.header.frame_id = "world";
    state.revision = 1;
    state.step = n;
    state.time = t;
    for (const auto& o : scene.objects) {
      const double share = o.model == vest::scene::ObjectModel::Rigid ? 0.0 : 1.0;
      for (std::size_t i = 0; i < o.rest_position.size(); ++i) {
        const Vector3d& p0 = i < o.position.size() ? o.position[i] : o.rest_position[i];
        const double d2 = (p0 - held).squaredNorm() / (0.018 * 0.018);
        const double breath = still ? 0.0 : 0.0006 * std::sin(1.5 * t + 40 * p0.x());
        const Vector3d p = p0 + share * (std::exp(-d2) * pull + Vector3d(0, 0, breath));
        for (int k = 0; k < 3; ++k) state.positions.push_back(static_cast<float>(p[k]));
      }
    }
    if (words.count("fields") != 0 && n % fewer == 0) tools::addFields(scene, t, &state);
    state_pub.publish(state);
    if (n % few == 0) {
      if (words.count("clips") != 0) attachments_pub.publish(tools::attachmentsAt(scene));
      if (words.count("sutures") != 0) sutures_pub.publish(tools::suturesAt(scene, t));
      if (words.count("fluid") != 0) fluid_pub.publish(tools::fluidAt(scene, t));
      if (words.count("smoke") != 0) smoke_pub.publish(tools::smokeAt(scene, t));
      if (words.count("monitor") != 0) monitor_pub.publish(tools::haemodynamicsAt(t));
    }
    if (words.count("lens") != 0 && n % fewer == 0) lens_pub.publish(tools::lensAt(0.3));
    vest_msgs::InstrumentStates instruments;
    instruments.header = state.header;
    instruments.sequence = n + 1;
    instruments.instruments.push_back(tools::instrumentAt(tools::Place::Left, held + pull, 0.4, 0.12));
    instruments.instruments.push_back(tools::instrumentAt(
        tools::Place::Right, Vector3d(0.03 + 0.01 * std::sin(0.8 * t), 0.045, 0.075), -0.3, 0.5));
    const Vector3d tip =
        view.size() == 3 ? Vector3d(view[0], view[1], view[2]) : tools::endoscopeTip(insertion);
    instruments.instruments.push_back(tools::instrumentAt(tools::Place::Endoscope, tip, 0, 0));
    instruments_pub.publish(instruments);
    ros::spinOnce();
    pace.sleep();
  }
  return 0;
}

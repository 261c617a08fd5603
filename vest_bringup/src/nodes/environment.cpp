#include <memory>
#include <string>

#include <ros/package.h>
#include <ros/ros.h>
#include <vest_msgs/EnvStep.h>

#include "vest_bringup/learning/environment.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_instruments/ros/node_help.h"

// A task for learning as a service: lockstep for those who stay in ROS (docs/learning.md).

namespace {

using Request = vest_msgs::EnvStep::Request;
using Response = vest_msgs::EnvStep::Response;
namespace learning = vest::learning;

/// @throws std::invalid_argument where a parameter has another type
template <class T>
T parameter(const ros::NodeHandle& nh, const std::string& name, const T& otherwise) {
  T value = otherwise;
  if (nh.hasParam(name) && !nh.getParam(name, value))
    throw std::invalid_argument("~" + name + " has the wrong type (docs/learning.md)");
  return value;
}

learning::TaskOptions optionsOf(const ros::NodeHandle& nh) {
  learning::TaskOptions o;
  o.task = parameter<std::string>(nh, "task", "reach");
  o.skip = parameter(nh, "skip", 20);
  o.limit = parameter(nh, "limit", 0.0);
  std::string scene;
  for (const learning::TaskRow& row : learning::tasks())
    if (o.task == row.name) scene = row.scene;
  const bool exercise = scene.empty();
  if (exercise) {
    o.task = vest::ros_shell::exerciseFile(o.task);
    scene = vest::exercise::loadExercise(o.task).scene;
  }
  o.scene = parameter<std::string>(
      nh, "scene", ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml");
  o.box = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml";
  if (parameter(nh, "effects", false) || exercise)
    o.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  return o;
}

void answer(learning::Environment& env, const Request& req, Response& res) {
  if (req.reset && !req.action.empty())
    throw std::invalid_argument("action: a reset has none (allowed: an empty one)");
  if (!req.reset && req.action.size() != env.task().actionSize())
    throw std::invalid_argument("action: " + std::to_string(req.action.size()) +
                                " numbers (allowed: " + std::to_string(env.task().actionSize()) + ")");
  res.observation.resize(env.task().observationSize());
  if (req.reset) {
    env.reset(req.seed, res.observation.data());
    res.score = res.observation[res.observation.size() - 2];
  } else {
    const auto result = env.step(req.action.data(), res.observation.data());
    res.reward = result.reward, res.score = result.score;
    res.terminated = result.terminated, res.truncated = result.truncated, res.passed = result.passed;
  }
  res.step = env.world().steps(), res.state_hash = env.world().stateHash();
  res.success = true;
}

/// The environment and its service.
struct Node {
  ros::NodeHandle nh, own{"~"};
  std::unique_ptr<learning::Environment> env =
      learning::makeEnvironment(learning::makeTask(optionsOf(own)), parameter(own, "threads", 1));
  ros::ServiceServer server = nh.advertiseService(
      "session/env_step", boost::function<bool(Request&, Response&)>([this](Request& req, Response& res) {
        try {
          answer(*env, req, res);
        } catch (const std::exception& e) {
          res = Response();
          res.message = e.what();
        }
        return true;
      }));
};

}  // namespace

int main(int argc, char** argv) {
  return vest::ros_shell::runNode(
      argc, argv, "environment",
      "usage: rosrun vest_bringup environment _task:=reach [_skip:=20] [_limit:=S] [_effects:=true] "
      "[_scene:=FILE] [_threads:=1]\n"
      "A task for learning behind the service session/env_step (vest_msgs/EnvStep): docs/learning.md.",
      [] { return std::make_unique<Node>(); });
}

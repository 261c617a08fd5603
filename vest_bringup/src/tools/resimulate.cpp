#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <string>

#include <ros/package.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <CLI/CLI.hpp>

#include <vest_msgs/StateHash.h>
#include <vest_msgs/StepInput.h>

#include "vest_bringup/session/resimulation.h"
#include "vest_tissue/ros/conversions.h"

// Re-simulates a session from its step_inputs and compares the state hashes on the way.

namespace {

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string sceneFile(const std::string& scene) {
  if (scene.find('/') != std::string::npos || endsWith(scene, ".yaml")) return scene;
  return ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
}

std::vector<std::uint8_t> readFile(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::invalid_argument(file + ": cannot be read");
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Re-simulates a recorded session from its step_inputs; exit 0: every state hash is the same"};
  std::string directory, scene;
  int threads = 1;
  app.add_option("DIR", directory, "folder with session.bag")->required();
  app.add_option("--threads", threads, "worker threads")->check(CLI::Range(1, 64));
  app.add_option("--scene", scene, "scene name or file; default: what the bag names");
  CLI11_PARSE(app, argc, argv);
  try {
    rosbag::Bag bag(directory + "/session.bag", rosbag::bagmode::Read);
    std::string recorded_hash;
    std::vector<vest_msgs::StepInput::ConstPtr> inputs;
    // By step and stamp: a reset begins the steps anew, and stamps go back where the clock was set back.
    std::map<std::pair<std::uint64_t, ros::Time>, std::uint64_t> hashes;
    for (const rosbag::MessageInstance& m : rosbag::View(bag)) {
      if (endsWith(m.getTopic(), "step_inputs")) {
        inputs.push_back(m.instantiate<vest_msgs::StepInput>());
      } else if (endsWith(m.getTopic(), "tissue/state_hash")) {
        const auto hash = m.instantiate<vest_msgs::StateHash>();
        hashes[{hash->step, hash->header.stamp}] = hash->hash;
      } else if (recorded_hash.empty() && endsWith(m.getTopic(), "tissue/topology")) {
        const auto topology = m.instantiate<vest_msgs::TissueTopology>();
        recorded_hash = topology->scene_hash;
        if (scene.empty()) scene = topology->scene;
      }
    }
    if (inputs.empty()) throw std::invalid_argument(directory + "/session.bag: no step_inputs in it");
    if (scene.empty())
      throw std::invalid_argument(directory +
                                  "/session.bag: no tissue/topology names the scene (use --scene)");
    vest::scene::Description description = vest::scene::loadScene(sceneFile(scene));
    if (!recorded_hash.empty() && description.hash != recorded_hash) {
      throw std::invalid_argument("scene " + scene + " has scene_hash " + description.hash +
                                  ", the session was recorded with " + recorded_hash);
    }
    vest::scene::World world(description, threads);
    vest::session::Resimulation resimulation(world);
    if (inputs.front()->step != 1) {
      resimulation.begin(readFile(directory + "/snapshots/start.snapshot"));
    }
    for (const auto& msg : inputs) {
      if (msg->step <= world.steps() && msg->command == 0) continue;  // before the snapshot
      vest::scene::StepInput input;
      vest::ros_shell::fromMsg(*msg, world.description(), input);
      const auto command = static_cast<vest::scene::Command>(msg->command);
      if (command == vest::scene::Command::Load) {
        world = vest::scene::World(vest::scene::loadScene(sceneFile(msg->command_argument)), threads);
      } else if (command == vest::scene::Command::Restore) {
        const std::string& name = msg->command_argument;
        resimulation.begin(readFile(
            name.find('/') != std::string::npos ? name : directory + "/snapshots/" + name + ".snapshot"));
      }
      const auto missing = resimulation.step(input, command == vest::scene::Command::Reset,
                                             command != vest::scene::Command::None);
      if (missing) {
        std::printf("step %llu is missing before step %llu\n", static_cast<unsigned long long>(*missing),
                    static_cast<unsigned long long>(input.step));
        return 1;
      }
      const auto recorded = hashes.find({input.step, msg->header.stamp});
      if (recorded != hashes.end() && !resimulation.compare(recorded->second)) {
        std::printf("first difference: state hash after step %llu: recorded %016llx, re-simulated %016llx\n",
                    static_cast<unsigned long long>(input.step),
                    static_cast<unsigned long long>(recorded->second),
                    static_cast<unsigned long long>(world.stateHash()));
        return 1;
      }
    }
    std::printf("%llu steps, %llu state hashes, all the same (%d thread%s, kernel %s)\n",
                static_cast<unsigned long long>(resimulation.steps()),
                static_cast<unsigned long long>(resimulation.compared()), threads, threads == 1 ? "" : "s",
                std::string(world.kernelLevel()).c_str());
    if (resimulation.compared() == 0) {
      std::printf("no state hash was compared: the session is shorter than 100 steps\n");
      return 1;
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_resimulate: %s\n", e.what());
    return 2;
  }
  return 0;
}

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_bringup/ros/recorded_session.h"
#include "vest_bringup/session/resimulation.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/scene/world.h"

// Re-simulates a session from its step_inputs and compares what was recorded on the way.

namespace {

namespace fs = std::filesystem;
using vest::session::RecordedScene;
using vest::session::RecordedSession;
using vest::session::Resimulation;

bool isFile(const std::string& scene) {
  return scene.find('/') != std::string::npos || fs::path(scene).extension() == ".yaml";
}

std::string sceneFile(const std::string& scene) {
  if (isFile(scene)) return scene;
  return ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
}

std::vector<std::uint8_t> readFile(const std::string& file) {
  constexpr std::uintmax_t kMost = 1U << 30U;
  std::error_code error;
  if (!fs::is_regular_file(file, error) || fs::file_size(file, error) > kMost)
    throw std::invalid_argument(file + ": cannot be read (allowed: a file of at most 1 GB)");
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// A folder that goes with the program.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "vest_scene_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// The scenes of a session, from its bag, else from where the session says that they are.
class Scenes {
 public:
  Scenes(const RecordedSession& session, std::string wanted, int threads, bool effects)
      : session_(session), wanted_(std::move(wanted)), threads_(threads), effects_(effects) {}

  std::unique_ptr<vest::scene::Simulation> first() {
    const auto& scenes = session_.scenes();
    if (!wanted_.empty()) return make(fromDisk(wanted_, session_.sceneHash()));
    if (!scenes.empty()) return make(recorded(scenes[next_++]));
    if (session_.sceneName().empty())
      throw std::invalid_argument(session_.file() + ": no tissue/topology names the scene (use --scene)");
    return make(fromDisk(session_.sceneName(), session_.sceneHash()));
  }

  /// The one that the session loaded next.
  std::unique_ptr<vest::scene::Simulation> loaded(const std::string& scene) {
    const auto& scenes = session_.scenes();
    for (std::size_t i = next_; i < scenes.size(); ++i) {
      if (scenes[i].scene != scene) continue;
      next_ = i + 1;
      return make(recorded(scenes[i]));
    }
    return make(fromDisk(scene, ""));
  }

 private:
  vest::scene::Description fromDisk(const std::string& scene, const std::string& hash) const {
    vest::scene::Description description = vest::scene::loadScene(sceneFile(scene));
    check(description, scene, hash);
    return description;
  }

  vest::scene::Description recorded(const RecordedScene& scene) const {
    if (scene.files.files.empty()) return fromDisk(scene.scene, scene.hash);
    const Folder folder;
    const std::string file = vest::scene::writeSceneFiles(scene.files, folder.path());
    const char* const before = std::getenv("VEST_TISSUE_DATA");
    const std::string kept = before ? before : "";
    if (!scene.files.materials.empty()) setenv("VEST_TISSUE_DATA", (folder.path() + "/database").c_str(), 1);
    vest::scene::Description description;
    try {
      description = vest::scene::loadScene(file);
    } catch (const std::exception& e) {
      throw std::invalid_argument("the scene '" + scene.scene + "' in it cannot be loaded: " + e.what());
    }
    before ? setenv("VEST_TISSUE_DATA", kept.c_str(), 1) : unsetenv("VEST_TISSUE_DATA");
    check(description, scene.scene, scene.hash);
    return description;
  }

  void check(const vest::scene::Description& description, const std::string& scene,
             const std::string& hash) const {
    if (!hash.empty() && description.hash != hash)
      throw std::invalid_argument("scene " + scene + " has scene_hash " + description.hash +
                                  ", the session was recorded with " + hash);
  }

  std::unique_ptr<vest::scene::Simulation> make(const vest::scene::Description& description) const {
    vest::scene::World world(description, threads_);
    if (!effects_) return std::make_unique<vest::scene::TissueSimulation>(std::move(world));
    return std::move(vest::simulation::makeStage(std::move(world), options()).trainer);
  }

  vest::simulation::StageOptions options() const {
    const vest_msgs::EffectsOptions& recorded = *session_.effects();
    if (recorded.names.size() != recorded.values.size())
      throw std::invalid_argument("effects/options has " + std::to_string(recorded.names.size()) +
                                  " names and " + std::to_string(recorded.values.size()) + " values");
    vest::simulation::StageOptions options;
    options.blood.vessels = isFile(recorded.vessels)
                                ? recorded.vessels
                                : ros::package::getPath("vest_effects") + "/data/vessels/" + recorded.vessels;
    eachNumber(options, [&](const std::string& name, double& to, double low, double high) {
      for (std::size_t i = 0; i < recorded.names.size(); ++i) {
        if (recorded.names[i] != name) continue;
        to = recorded.values[i];
        if (!(to >= low && to <= high))
          throw std::invalid_argument("effects/options: " + name + " is " + std::to_string(to) +
                                      " (allowed: " + std::to_string(low) + " to " + std::to_string(high) +
                                      ")");
      }
    });
    return options;
  }

  const RecordedSession& session_;
  std::string wanted_;
  int threads_;
  bool effects_;
  std::size_t next_ = 0;
};

/// Ends the comparison with what differs first.
struct Difference : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

void judge(Resimulation::Outcome outcome, std::uint64_t step, std::uint64_t here) {
  const std::string number = std::to_string(step);
  switch (outcome) {
    case Resimulation::Outcome::Same:
      return;
    case Resimulation::Outcome::Missing:
      throw Difference("step " + std::to_string(here + 1) + " is missing before step " + number);
    case Resimulation::Outcome::Feedback:
      throw Difference("first difference: what the effects handed to step " + number);
    case Resimulation::Outcome::Fault:
      throw Difference("first difference: FAULT in step " + number + ", which the session did not have");
    case Resimulation::Outcome::NoFault:
      throw Difference("first difference: no FAULT in step " + number + ", which the session had");
  }
}

void resimulate(const std::string& directory, const std::string& scene, int threads, bool effects) {
  RecordedSession session(directory + "/session.bag");
  if (session.stepCount() == 0) throw std::invalid_argument("no step_inputs in it");
  effects = effects && session.effects();
  Scenes scenes(session, scene, threads, effects);
  Resimulation resimulation(scenes.first(), effects);
  const auto begin = [&](const std::string& name) {
    // A session that was moved has its snapshots still beside it.
    std::string file = directory + "/snapshots/" + fs::path(name).filename().string();
    if (!isFile(name)) file += ".snapshot";
    if (!fs::exists(file) && isFile(name)) file = name;
    try {
      resimulation.begin(readFile(file));
    } catch (const std::invalid_argument& e) {
      const std::string what = e.what();
      throw std::invalid_argument(what.rfind(file, 0) == 0 ? what : file + ": " + what);
    }
  };
  if (session.firstStep() != 1) begin("start");
  session.steps([&](const vest_msgs::StepInput& msg) {
    using vest::scene::Command;
    if (msg.step <= resimulation.world().steps() && msg.command == 0) return;  // before the snapshot
    const auto command = static_cast<Command>(msg.command);
    if (command == Command::Load) {
      resimulation.load(scenes.loaded(msg.command_argument));
    } else if (command == Command::Restore) {
      begin(msg.command_argument);
    } else if (msg.command > static_cast<std::uint8_t>(Command::Restore)) {
      throw std::invalid_argument("step " + std::to_string(msg.step) + ": command is " +
                                  std::to_string(msg.command) + " (allowed: 0 to 3)");
    }
    vest::scene::StepInput input;
    vest::ros_shell::fromMsg(msg, resimulation.world().description(), input);
    const RecordedSession::Step step{msg.step, msg.header.stamp};
    const std::uint64_t here = resimulation.world().steps();
    judge(
        resimulation.step(input, command == Command::Reset, command != Command::None, session.hadFault(step)),
        msg.step, here);
    const auto recorded = session.stateHash(step);
    if (recorded && !resimulation.compare(*recorded))
      throw Difference("first difference: state hash after step " + std::to_string(msg.step) + ": recorded " +
                       hex(*recorded) + ", re-simulated " + hex(resimulation.world().stateHash()));
    const auto of_effects = session.effectsHash(step);
    if (of_effects && !resimulation.compareEffects(*of_effects))
      throw Difference("first difference: the effects' hash after step " + std::to_string(msg.step) +
                       ": recorded " + hex(*of_effects) + ", re-simulated " +
                       hex(resimulation.simulation().effectsHash().value_or(0)));
  });
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  if (resimulation.compared() == 0)
    throw Difference("no state hash was compared: the session is shorter than 100 steps");
  const std::string more = effects ? ", " + std::to_string(resimulation.comparedEffects()) +
                                         " hashes of the effects and what they handed back in each step"
                                   : "";
  std::printf("%llu steps, %llu state hashes%s, all the same (%d thread%s, kernel %s)\n",
              count(resimulation.steps()), count(resimulation.compared()), more.c_str(), threads,
              threads == 1 ? "" : "s", std::string(resimulation.world().kernelLevel()).c_str());
  if (resimulation.faults() > 0)
    std::printf("%llu of these steps are FAULTs, as in the session\n", count(resimulation.faults()));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Re-simulates a recorded session from its step_inputs. Exit 0: every state hash, every FAULT, and with "
      "--effects their hashes and what they handed to each step are the same"};
  std::string directory, scene;
  int threads = 1;
  bool effects = false;
  app.add_option("DIR", directory, "folder with session.bag")->required();
  app.add_option("--threads", threads, "worker threads")->check(CLI::Range(1, 64));
  app.add_option("--scene", scene, "scene name or file; default: the one that the bag carries, else names");
  app.add_flag("--effects", effects,
               "simulates the effects again, too (where the session says what they were)");
  CLI11_PARSE(app, argc, argv);
  try {
    resimulate(directory, scene, threads, effects);
  } catch (const Difference& e) {
    std::printf("%s\n", e.what());
    return 1;
  } catch (const std::exception& e) {
    const std::string what = e.what();
    const bool named = what.rfind(directory, 0) == 0;
    std::fprintf(stderr, "vest_resimulate: %s%s\n", named ? "" : (directory + "/session.bag: ").c_str(),
                 what.c_str());
    return 2;
  }
  return 0;
}

#include "vest_bringup/ros/session_player.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include <ros/package.h>

#include "vest_bringup/simulation/stage.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/scene/world.h"

namespace vest::session {
namespace {

namespace fs = std::filesystem;

bool isFile(const std::string& scene) {
  return scene.find('/') != std::string::npos || fs::path(scene).extension() == ".yaml";
}

std::string sceneFile(const std::string& scene) {
  if (isFile(scene)) return scene;
  return ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
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

/// The databases of a session in the place of this machine's, while its scene is loaded.
class Databases {
 public:
  explicit Databases(const std::string& folder) {
    if (const char* const before = std::getenv(kName)) kept_ = before;
    if (fs::exists(folder)) setenv(kName, folder.c_str(), 1);
  }
  ~Databases() { kept_ ? setenv(kName, kept_->c_str(), 1) : unsetenv(kName); }
  Databases(const Databases&) = delete;
  Databases& operator=(const Databases&) = delete;

 private:
  static constexpr const char* kName = "VEST_TISSUE_DATA";
  std::optional<std::string> kept_;
};

std::optional<exercise::Exercise> parsed(const RecordedSession& session, const std::string& text) {
  if (text.empty()) return {};
  return exercise::parseExercise(session.file() + ": session/exercise_file", text);
}

/// The scenes of a session, from its bag, else from where the session says that they are.
class Scenes {
 public:
  Scenes(const RecordedSession& session, const PlayOptions& options) : session_(session), options_(options) {
    if (options.effects && !options.exercise)
      for (const auto& file : session.exerciseFiles()) exercises_.push_back(parsed(session, file.text));
  }

  std::unique_ptr<scene::Simulation> first() {
    choose(session_.begin());
    const auto& scenes = session_.scenes();
    if (!options_.scene.empty()) return make(fromDisk(options_.scene, session_.sceneHash()));
    if (!scenes.empty()) return make(recorded(scenes[next_++]));
    if (session_.sceneName().empty())
      throw std::invalid_argument(session_.file() + ": no tissue/topology names the scene (use --scene)");
    return make(fromDisk(session_.sceneName(), session_.sceneHash()));
  }

  /// Of the scene that was made last; null where no exercise is done in it.
  exercise::Engine* engine() const { return engine_; }

  /// The one that the session loaded next. @param stamp of the first step in it
  std::unique_ptr<scene::Simulation> loaded(const std::string& scene, const ros::Time& stamp) {
    choose(stamp);
    const auto& scenes = session_.scenes();
    for (std::size_t i = next_; i < scenes.size(); ++i) {
      if (scenes[i].scene != scene) continue;
      next_ = i + 1;
      return make(recorded(scenes[i]));
    }
    return make(fromDisk(scene, ""));
  }

 private:
  /// The exercise of the scenes that are made from now on: what was told last. Of a session's first scene the
  /// stamps may lie, where the clock was set: then the first one.
  void choose(const ros::Time& stamp) {
    exercise_ = options_.exercise;
    for (std::size_t i = 0; i < exercises_.size(); ++i)
      if (i == 0 || session_.exerciseFiles()[i].stamp <= stamp)
        exercise_ = exercises_[i] ? &*exercises_[i] : nullptr;
  }

  scene::Description fromDisk(const std::string& scene, const std::string& hash) const {
    scene::Description description = scene::loadScene(sceneFile(scene));
    check(description, scene, hash);
    return description;
  }

  scene::Description recorded(const RecordedScene& scene) const {
    if (scene.files.files.empty()) return fromDisk(scene.scene, scene.hash);
    const Folder folder;
    const std::string file = scene::writeSceneFiles(scene.files, folder.path());
    const Databases databases(folder.path() + "/database");
    scene::Description description;
    try {
      description = scene::loadScene(file);
    } catch (const std::exception& e) {
      throw std::invalid_argument("the scene '" + scene.scene + "' in it cannot be loaded: " + e.what());
    }
    check(description, scene.scene, scene.hash);
    return description;
  }

  void check(const scene::Description& description, const std::string& scene, const std::string& hash) const {
    if (!hash.empty() && description.hash != hash)
      throw std::invalid_argument("scene " + scene + " has scene_hash " + description.hash +
                                  ", the session was recorded with " + hash);
  }

  std::unique_ptr<scene::Simulation> make(const scene::Description& description) const {
    engine_ = nullptr;
    scene::World world(description, options_.threads);
    if (!options_.effects) return std::make_unique<scene::TissueSimulation>(std::move(world));
    auto stage = simulation::makeStage(std::move(world), options(), options_.frames);
    if (exercise_ && exercise_->scene == description.name)
      engine_ = &exercise::addExercise(*exercise_, stage);
    return std::move(stage.trainer);
  }

  simulation::StageOptions options() const {
    const vest_msgs::EffectsOptions& recorded = *session_.effects();
    if (recorded.names.size() != recorded.values.size())
      throw std::invalid_argument("effects/options has " + std::to_string(recorded.names.size()) +
                                  " names and " + std::to_string(recorded.values.size()) + " values");
    simulation::StageOptions options;
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
  const PlayOptions& options_;
  std::vector<std::optional<exercise::Exercise>> exercises_;  ///< as the session's exerciseFiles()
  const exercise::Exercise* exercise_ = nullptr;
  mutable exercise::Engine* engine_ = nullptr;
  std::size_t next_ = 0;
};

std::string hashText(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

/// Whether simulated time went with the session's stamps, second by second.
class Pace {
 public:
  void add(double stamp, double dt) {
    simulated_ += dt;
    const double passed = stamp - begun_;
    if (begun_ > 0 && passed >= 0 && passed < 1) return;
    if (begun_ > 0 && passed >= 1) kept_ = kept_ && std::fabs(simulated_ / passed - 1) <= kMostOff;
    begun_ = stamp, simulated_ = 0;  // also where the clock was set back
  }
  bool kept() const { return kept_; }

 private:
  static constexpr double kMostOff = 0.05;  ///< assumed
  double begun_ = 0, simulated_ = 0;
  bool kept_ = true;
};

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

/// What was recorded within the session, of a step that is not in it.
void judgeWhatIsLeft(const std::map<RecordedSession::Step, const char*>& left, const ros::Time& begin,
                     const ros::Time& end) {
  for (const auto& [step, what] : left)
    if (step.second >= begin && step.second <= end)
      throw Difference(std::string("first difference: ") + what + " of step " + std::to_string(step.first) +
                       ", and no step input has its number and stamp");
}

}  // namespace

std::optional<exercise::Exercise> exerciseOf(const RecordedSession& session) {
  const auto& files = session.exerciseFiles();
  return files.empty() ? std::nullopt : parsed(session, files.back().text);
}

Played play(const std::string& directory, RecordedSession& session, PlayOptions options,
            const PlayWatch& watch) {
  if (session.stepCount() == 0) throw std::invalid_argument("no step_inputs in it");
  options.effects = options.effects && session.effects();
  // Its engine is an effect: feedback does not change with it, but snapshots have its State.
  Scenes scenes(session, options);
  Resimulation resimulation(scenes.first(), options.effects);
  const auto begin = [&](const std::string& name) {
    // A session that was moved has its snapshots still beside it.
    std::string file = directory + "/snapshots/" + fs::path(name).filename().string();
    if (!isFile(name)) file += ".snapshot";
    if (!fs::exists(file) && isFile(name)) file = name;
    try {
      constexpr std::size_t kMost = 1U << 30U;  // bytes, as of the service tissue/snapshot
      const std::string bytes = files::read(file, kMost);
      resimulation.begin({bytes.begin(), bytes.end()});
    } catch (const std::invalid_argument& e) {
      const std::string what = e.what();
      throw std::invalid_argument(what.rfind(file, 0) == 0 ? what : file + ": " + what);
    }
  };
  if (session.firstStep() != 1) {
    begin("start");
    if (scenes.engine()) scenes.engine()->goOn();
  }
  Pace pace;
  Played played;
  std::map<RecordedSession::Step, const char*> left = session.judgements();
  ros::Time end;
  session.steps([&](const vest_msgs::StepInput& msg) {
    using scene::Command;
    const RecordedSession::Step step{msg.step, end = msg.header.stamp};
    left.erase(step);
    if (msg.step <= resimulation.world().steps() && msg.command == 0) return;  // before the snapshot
    const auto command = static_cast<Command>(msg.command);
    if (command == Command::Load) {
      resimulation.load(scenes.loaded(msg.command_argument, msg.header.stamp));
    } else if (command == Command::Adopt) {
      resimulation.adopt(scenes.loaded(msg.command_argument, msg.header.stamp));
    } else if (command == Command::Restore) {
      begin(msg.command_argument);
    } else if (msg.command > static_cast<std::uint8_t>(Command::Adopt)) {
      throw std::invalid_argument("step " + std::to_string(msg.step) + ": command is " +
                                  std::to_string(msg.command) + " (allowed: 0 to 4)");
    }
    scene::StepInput input;
    ros_shell::fromMsg(msg, resimulation.world().description(), input);
    const std::uint64_t here = resimulation.world().steps();
    judge(
        resimulation.step(input, command == Command::Reset, command != Command::None, session.hadFault(step)),
        msg.step, here);
    const auto recorded = session.stateHash(step);
    if (recorded && !resimulation.compare(*recorded))
      throw Difference("first difference: state hash after step " + std::to_string(msg.step) + ": recorded " +
                       hashText(*recorded) + ", re-simulated " + hashText(resimulation.world().stateHash()));
    const auto of_effects = session.effectsHash(step);
    if (of_effects && !resimulation.compareEffects(*of_effects))
      throw Difference("first difference: the effects' hash after step " + std::to_string(msg.step) +
                       ": recorded " + hashText(*of_effects) + ", re-simulated " +
                       hashText(resimulation.simulation().effectsHash().value_or(0)));
    if (scenes.engine() && (msg.step == 1 || played.exercise_begin.isZero()))  // a reset is a new attempt
      pace = Pace(), played.exercise_begin = msg.header.stamp;
    if (scenes.engine() && !scenes.engine()->finished()) pace.add(msg.header.stamp.toSec(), msg.dt);
    if (watch) watch(resimulation.world(), resimulation.input(), resimulation.report(), scenes.engine());
  });
  judgeWhatIsLeft(left, session.begin(), end);
  played.steps = resimulation.steps(), played.compared = resimulation.compared();
  played.compared_effects = resimulation.comparedEffects();
  played.faults = resimulation.faults();
  played.kernel = resimulation.world().kernelLevel();
  if (!scenes.engine()) return played;
  played.result = scenes.engine()->result();
  if (!pace.kept()) played.result->flags |= exercise::kPractice;
  return played;
}

}  // namespace vest::session

#pragma once

#include <memory>
#include <string>

#include <rosbag/bag.h>

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_tissue/scene/scene_files.h"

namespace vest::session {

/// What re-simulation and scoring need of a session, recorded while a script plays without ROS, box or wall
/// time. Stamped with simulated time. Where it cannot be written it is removed.
class ScriptedSession {
 public:
  /// Makes the folder and DIRECTORY/session.bag.
  /// @param vessels folder or name, as effects/options tells it
  /// @throws std::invalid_argument, as all that writes: where there is a session already, or no room
  ScriptedSession(const std::string& directory, const scene::SceneFiles& files, const scene::World& world,
                  simulation::StageOptions options, const std::string& vessels);
  /// A step that was done.
  void write(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report);
  ~ScriptedSession();
  ScriptedSession(const ScriptedSession&) = delete;
  ScriptedSession& operator=(const ScriptedSession&) = delete;
  /// The exercise, before its first step, and what it came to.
  void writeExercise(const std::string& file_text);
  void writeResult(const std::string& json);
  /// Nothing may be written afterwards.
  void close();

 private:
  template <class M>
  void put(const std::string& topic, M& message);
  void putText(const std::string& topic, const std::string& text);

  [[noreturn]] void giveUp();

  std::string file_;
  std::unique_ptr<rosbag::Bag> bag_ = std::make_unique<rosbag::Bag>();
  ros::Time time_{1.0};  ///< a bag has no time 0
};

}  // namespace vest::session

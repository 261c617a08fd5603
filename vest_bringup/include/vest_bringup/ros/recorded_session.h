#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <ros/time.h>
#include <vest_msgs/EffectsOptions.h>
#include <vest_msgs/StepInput.h>

#include "vest_bringup/ros/bag_reader.h"
#include "vest_tissue/scene/scene_files.h"

namespace vest::session {

/// A scene that a session used, in the order in which it did.
struct RecordedScene {
  std::string scene;  ///< as it was asked for
  std::string hash;
  scene::SceneFiles files;  ///< empty: the session names the scene and does not carry it
};

/// What re-simulation needs of a session's bag. Everything in it may be a lie: types and counts are checked
/// before anything is made of them.
class RecordedSession {
 public:
  /// A step of a session. A reset begins the numbers anew, and stamps go back where the clock was set back.
  using Step = std::pair<std::uint64_t, ros::Time>;

  /// Reads all but the steps. @throws std::invalid_argument naming the file, and the topic and type or the
  /// field that cannot be
  explicit RecordedSession(const std::string& file);

  /// Each step in its order. @throws as above; what the callback throws, behind the file's name
  void steps(const std::function<void(const vest_msgs::StepInput& input)>& callback);

  const std::string& file() const { return reader_.file(); }
  std::uint64_t stepCount() const { return steps_; }
  std::uint64_t firstStep() const { return first_step_; }
  const std::vector<RecordedScene>& scenes() const { return scenes_; }
  /// Of the first tissue/topology: name and scene_hash; empty without one.
  const std::string& sceneName() const { return scene_name_; }
  const std::string& sceneHash() const { return scene_hash_; }
  /// Recorded after a step: of the tissue, and of the effects.
  std::optional<std::uint64_t> stateHash(const Step& step) const { return find(state_hashes_, step); }
  std::optional<std::uint64_t> effectsHash(const Step& step) const { return find(effects_hashes_, step); }
  bool hadFault(const Step& step) const { return faults_.count(step) > 0; }
  /// What was recorded of steps: hashes and FAULTs. One whose step is not there is compared with nothing.
  std::map<Step, const char*> judgements() const;
  /// What the effects of the session were; nothing where it had none, or does not tell.
  const std::optional<vest_msgs::EffectsOptions>& effects() const { return effects_; }
  /// Stamp of the first step.
  const ros::Time& begin() const { return begin_; }
  /// A text with the stamp that it was published with.
  struct Text {
    ros::Time stamp;
    std::string text;
  };
  /// Text of each exercise's file, in the order in which they were chosen: one counts for the scenes that are
  /// loaded after it. An empty one: none is done.
  const std::vector<Text>& exerciseFiles() const { return exercise_files_; }
  /// What a teacher told the trainee.
  const std::vector<Text>& notes() const { return notes_; }
  /// Result that the session came to last (JSON); empty without one.
  const std::string& result() const { return result_; }

 private:
  using Hashes = std::map<Step, std::uint64_t>;
  static std::optional<std::uint64_t> find(const Hashes& in, const Step& step);
  void note(const BagMessage& message);

  BagReader reader_;
  std::uint64_t steps_ = 0, first_step_ = 0;
  std::string scene_name_, scene_hash_;
  std::vector<RecordedScene> scenes_;
  Hashes state_hashes_, effects_hashes_;
  std::set<Step> faults_;
  std::optional<vest_msgs::EffectsOptions> effects_;
  ros::Time begin_;
  std::vector<Text> exercise_files_, notes_;
  std::string result_;
};

}  // namespace vest::session

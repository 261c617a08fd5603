#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/ros/recorded_session.h"
#include "vest_bringup/session/resimulation.h"

namespace vest::session {

struct PlayOptions {
  std::string scene;  ///< name or file; empty: the one that the bag carries, else names
  int threads = 1;
  bool effects = false;  ///< simulates them again, where the session says what they were
  /// Done in the session's scenes of its name; needs effects. Null: those that the session carries, if any.
  const exercise::Exercise* exercise = nullptr;
  simulation::StageFrames frames;  ///< where effects put what is to be shown
};

struct Played {
  std::uint64_t steps = 0, compared = 0, compared_effects = 0, faults = 0;
  std::string kernel;
  ros::Time exercise_begin;  ///< stamp of the first step of the last attempt; zero: none
  /// With kPractice where within a second of the stamps simulated time was more than 5 % off real time.
  std::optional<exercise::Result> result;
};

/// Told after each step. `engine` is null while no exercise is done.
using PlayWatch = std::function<void(const scene::World& world, const scene::StepInput& input,
                                     const scene::StepReport& report, const exercise::Engine* engine)>;

/// The last exercise that the session carries; nothing where none was done. @throws std::invalid_argument
std::optional<exercise::Exercise> exerciseOf(const RecordedSession& session);

/// Ends the comparison with what differs first.
struct Difference : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Simulates a recorded session again from its step inputs and compares what was recorded on the way.
/// @param directory folder of the session  @throws Difference; std::invalid_argument naming what cannot be
Played play(const std::string& directory, RecordedSession& session, PlayOptions options,
            const PlayWatch& watch = {});

}  // namespace vest::session

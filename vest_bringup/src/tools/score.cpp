#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_bringup/ros/exercise_file.h"
#include "vest_bringup/ros/session_player.h"

// Scores a recorded session: simulates it again and lets the exercise's engine look at each step.

int main(int argc, char** argv) {
  CLI::App app{
      "Scores a recorded session by simulating it again with its effects. Exit 0: scored, and where the "
      "session "
      "has a score it is the same to the bit; 1: it differs; 2: refused"};
  std::string directory, name;
  vest::session::PlayOptions options;
  options.effects = true;
  bool json = false;
  app.add_option("DIR", directory, "folder with session.bag")->required();
  app.add_option("--exercise", name, "exercise or its file; default: the one that the session carries");
  app.add_option("--threads", options.threads, "worker threads")->check(CLI::Range(1, 64));
  app.add_flag("--json", json, "print JSON");
  CLI11_PARSE(app, argc, argv);
  namespace exercise = vest::exercise;
  try {
    vest::session::RecordedSession session(directory + "/session.bag");
    if (!session.effects())
      throw std::invalid_argument(
          "the session does not tell its effects (allowed: one with effects/options)");
    if (name.empty() && session.exerciseFile().empty())
      throw std::invalid_argument("no exercise was done in it (use --exercise)");
    const exercise::Exercise e =
        name.empty()
            ? exercise::parseExercise(session.file() + ": session/exercise_file", session.exerciseFile())
            : exercise::loadExercise(vest::ros_shell::exerciseFile(name));
    options.exercise = &e;
    const auto played = vest::session::play(directory, session, options);
    if (!played.result)
      throw std::invalid_argument("the exercise needs scene " + e.scene + ", the session has another one");
    const std::string result = exercise::toJson(e, *played.result);
    std::fputs((json ? result : exercise::toText(e, *played.result)).c_str(), stdout);
    if (name.empty() && !session.result().empty() && session.result() != result)
      throw vest::session::Difference("the score differs from the one of the session");
  } catch (const vest::session::Difference& e) {
    std::fprintf(stderr, "vest_score: %s\n", e.what());
    return 1;
  } catch (const std::exception& e) {
    const std::string what = e.what();
    const bool named = what.rfind(directory, 0) == 0;
    std::fprintf(stderr, "vest_score: %s%s\n", named ? "" : (directory + "/session.bag: ").c_str(),
                 what.c_str());
    return 2;
  }
  return 0;
}

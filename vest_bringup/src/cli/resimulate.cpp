#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_bringup/ros/session_player.h"
#include "vest_instruments/files/refusal.h"

// Re-simulates a session from its step_inputs and compares what was recorded on the way.

namespace {

void tell(const vest::session::Played& played, int threads, bool effects) {
  const auto count = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  if (played.compared == 0)
    throw vest::session::Difference("no state hash was compared: the session is shorter than 100 steps");
  const std::string more = effects ? ", " + std::to_string(played.compared_effects) +
                                         " hashes of the effects and what they handed back in each step"
                                   : "";
  std::printf("%llu steps, %llu state hashes%s, all the same (%d thread%s, kernel %s)\n", count(played.steps),
              count(played.compared), more.c_str(), threads, threads == 1 ? "" : "s", played.kernel.c_str());
  if (played.faults > 0)
    std::printf("%llu of these steps are FAULTs, as in the session\n", count(played.faults));
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
    vest::session::PlayOptions options;
    options.scene = scene, options.threads = threads, options.effects = effects;
    vest::session::RecordedSession session(directory + "/session.bag");
    tell(vest::session::play(directory, session, options), threads, effects && session.effects());
  } catch (const vest::session::Difference& e) {
    std::printf("%s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_resimulate: %s\n",
                 vest::files::refusal(e.what(), directory + "/session.bag").c_str());
    return 2;
  }
  return 0;
}

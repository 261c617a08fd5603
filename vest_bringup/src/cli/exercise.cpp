#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_bringup/ros/scripted_session.h"
#include "vest_bringup/simulation/rehearsal.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/tools/tool_names.h"
#include "vest_tissue/ros/scene_file.h"

// Exercises without a session: what there are, and what a script comes to.

namespace {

namespace exercise = vest::exercise;
namespace simulation = vest::simulation;

void list() {
  for (const std::string& name : vest::ros_shell::exerciseNames()) {
    const auto e = exercise::loadExercise(vest::ros_shell::exerciseFile(name));
    std::printf("%-18s %s (scene %s, %.0f s)\n", name.c_str(), e.title.c_str(), e.scene.c_str(), e.limit);
  }
}

void show(const std::string& name) {
  const auto e = exercise::loadExercise(vest::ros_shell::exerciseFile(name));
  std::printf("%s\n%s\n\nscene %s, at most %.0f s, proficient in %.0f s\n", e.title.c_str(), e.aim.c_str(),
              e.scene.c_str(), e.limit, e.proficient);
  for (const auto& p : e.phases) std::printf("  %s: %s\n", p.name.c_str(), p.instruction.c_str());
  for (const auto& g : e.gates) std::printf("  fails by %s: %s\n", g.name.c_str(), g.text.c_str());
  for (const auto& i : e.items)
    std::printf("  %s: %s, pass %g, proficient %g (%s)\n", i.name.c_str(),
                std::string(exercise::infoOf(i.number.metric).name).c_str(), i.pass, i.proficient,
                i.source.c_str());
}

/// Arguments of trainer.launch that give a person the exercise's tools and optic, a line each.
void tellTools(const std::string& name) {
  const auto e = exercise::loadExercise(vest::ros_shell::exerciseFile(name));
  for (std::size_t hand = 0; hand < e.tools.size(); ++hand) {
    if (e.tools[hand].empty()) continue;
    std::printf("%s_tool:=%s\n",
                std::string(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(hand))).c_str(),
                std::string(vest::tools::toolName(e.tools[hand].front())).c_str());
  }
  std::printf("optic_deg:=%g\n", e.optic);
  const auto& right = e.tools[static_cast<std::size_t>(vest::tools::Instrument::Right)];
  if (right.size() < 2) return;
  std::string tray;  // begins with what comes after the first tool
  for (std::size_t i = 1; i <= right.size(); ++i)
    tray += (i > 1 ? ", " : "") + std::string(vest::tools::toolName(right[i % right.size()]));
  std::printf("tool_tray:=[%s]\n", tray.c_str());
}

/// @param output folder that gets the session, for vest_score; empty: none
exercise::Result play(const exercise::Exercise& e, const std::string& script, int threads,
                      const std::string& output) {
  auto box = vest::kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") +
                                              "/config/trainer_box.yaml");
  box.arms[static_cast<std::size_t>(vest::tools::Instrument::Endoscope)].optic_angle =
      e.optic * exercise::kDegree;
  const auto trajectory = vest::trajectory::fromWaypoints(script, box);
  simulation::StageOptions options;
  options.blood.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  options.field_options.fluid.spacing = 0.003;
  try {
    simulation::apply(trajectory.effects, options);
  } catch (const std::exception& error) {
    throw std::invalid_argument(script + ": " + error.what());
  }
  vest::scene::SceneFiles files;
  const auto description = vest::scene::loadScene(vest::ros_shell::sceneFile(e.scene), files);
  simulation::Stage stage = simulation::makeStage(vest::scene::World(description, threads), options);
  const exercise::Engine& engine = exercise::addExercise(e, stage);
  std::unique_ptr<vest::session::ScriptedSession> session;
  if (!output.empty()) {
    session = std::make_unique<vest::session::ScriptedSession>(output, files, stage.trainer->world(), options,
                                                               "pelvis");
    session->writeExercise(vest::files::read(e.file, 1U << 20U));
  }
  simulation::rehearse(
      *stage.trainer, box, trajectory, simulation::handsOf(trajectory), 0,
      [&](double, const vest::scene::StepInput& input, const vest::scene::StepReport& report) {
        if (session) session->write(stage.trainer->world(), input, report);
      },
      [&] { return engine.finished(); });
  if (session) session->writeResult(exercise::toJson(e, engine.result())), session->close();
  return engine.result();
}

/// The scripts of an exercise by `pass`, `fail`, or a file.
std::vector<exercise::Script> scriptsOf(const exercise::Exercise& e, const std::string& wanted) {
  if (wanted == "pass") return {e.pass_script};
  if (wanted == "fail") return e.fail_scripts;
  return {{wanted, ""}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Exercises: what there are, what one asks for, and what a script comes to without a session"};
  app.require_subcommand(1);
  std::string name, script = "pass", output;
  int threads = 1;
  bool json = false;
  auto* const listing = app.add_subcommand("list", "all exercises");
  auto* const showing = app.add_subcommand("show", "what an exercise asks for");
  showing->add_option("NAME", name, "exercise, or the path of an exercise file")->required();
  auto* const tooling = app.add_subcommand("tools", "its tools as arguments of trainer.launch");
  tooling->add_option("NAME", name, "exercise, or the path of an exercise file")->required();
  auto* const running =
      app.add_subcommand("run", "plays a script; exit 1: it did not come out as its exercise says");
  running->add_option("NAME", name, "exercise, or the path of an exercise file")->required();
  running->add_option("--script", script, "pass, fail, or a waypoint file");
  running->add_option("--threads", threads, "worker threads")->check(CLI::Range(1, 64));
  running->add_option("--output", output, "folder that gets the session of a script, for vest_score");
  running->add_flag("--json", json, "print JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    if (listing->parsed()) list();
    if (showing->parsed()) show(name);
    if (tooling->parsed()) tellTools(name);
    if (!running->parsed()) return 0;
    const auto e = exercise::loadExercise(vest::ros_shell::exerciseFile(name));
    bool as_said = true;
    for (const exercise::Script& s : scriptsOf(e, script)) {
      const exercise::Result result = play(e, s.file, threads, output);
      output.clear();  // of the first script alone
      std::fputs((json ? exercise::toJson(e, result) : exercise::toText(e, result)).c_str(), stdout);
      const auto& by = result.failed_by;
      const bool good = script == "pass"   ? result.passed
                        : script == "fail" ? std::find(by.begin(), by.end(), s.reason) != by.end()
                                           : true;
      if (!good)
        std::fprintf(stderr, "vest_exercise: %s did not %s\n", s.file.c_str(),
                     script == "pass" ? "pass" : ("fail by " + s.reason).c_str());
      as_said = as_said && good;
    }
    return as_said ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_exercise: %s\n", vest::files::shown(e.what(), 4000).c_str());
    return 2;
  }
}

#include <chrono>
#include <cstdio>
#include <ctime>
#include <string>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_bringup/ros/moment_bag.h"
#include "vest_bringup/simulation/rehearsal.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/tools/tool_names.h"
#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/ros/scene_file.h"

namespace {

void tell(const vest::simulation::Stage& stage, const vest::simulation::RehearsalReport& report,
          double milliseconds_per_step, double processor_per_step) {
  const vest::scene::World& world = stage.trainer->world();
  for (const auto& e : report.events) {
    vest_msgs::TissueEvent m;
    vest::ros_shell::toMsg(e, world.description(), m);
    std::printf("%7.3f s  %s at [%.4f %.4f %.4f], %.3f N\n", 1e-3 * static_cast<double>(e.step),
                m.text.c_str(), e.position.x(), e.position.y(), e.position.z(), e.force);
  }
  std::printf(
      "%s moved %.1f mm; greatest force %.3f N; worst status %d; speed at the end %.2f mm/s (%s); %.3f ms "
      "per step, %.3f ms of processor time\n",
      report.tube.c_str(), 1e3 * report.tube_displacement, report.greatest_force,
      static_cast<int>(report.worst), 1e3 * report.settled_speed, report.fastest.c_str(),
      milliseconds_per_step, processor_per_step);
  std::printf("heat: %.1f J delivered by instruments\n", world.heat().delivered);
  std::printf("blood: %.2f ml lost, %.2f ml of it seeped; mean pressure %.0f mmHg\n",
              1e6 * stage.blood->circulation().lost, 1e6 * stage.surface->state().seeped,
              stage.blood->circulation().smoothed_pressure / 133.322);
  const auto& f = stage.field->fluid();
  std::printf(
      "fluid: %.2f ml emitted = %.2f particles + %.2f pools + %.2f films on the ground + %.2f stained + %.2f "
      "sucked + %.2f soaked + %.2f lost; %zu particles\n",
      1e6 * f.emitted,
      1e6 * (vest::fluid::particleVolume(stage.field->fluidModel(), f) + vest::fluid::pendingVolume(f)),
      1e6 * vest::fluid::poolVolume(stage.field->fluidModel(), f),
      1e6 * vest::fluid::filmVolume(stage.field->fluidModel(), f), 1e6 * f.stained, 1e6 * f.sucked,
      1e6 * f.soaked, 1e6 * f.lost, f.particles.count);
  const auto& smoke = stage.field->smoke();
  const auto& lens = stage.field->lens();
  std::printf("smoke: %.3f mg made, %.3f there, %.3f drawn; lens: %.1f °C, %.2f g/m2 of condensate\n",
              1e6 * smoke.made, 1e6 * vest::smoke::mass(stage.field->smokeModel(), smoke), 1e6 * smoke.drawn,
              lens.temperature - 273.15, 1e3 * lens.condensate);
  std::printf("hash: %016llx of the tissue, %016llx of the effects\n",
              static_cast<unsigned long long>(world.stateHash()),
              static_cast<unsigned long long>(stage.trainer->effectsHash().value_or(0)));
}

}  // namespace

// Plays a scripted motion into a scene, faster than real time and without a ROS master: for authors of demos
// and exercises, and for pictures.
int main(int argc, char** argv) {
  CLI::App app{"Plays waypoints (YAML) into a scene and tells what happened to the tissue"};
  std::string waypoints, scene = "gynaecology", bag;
  std::array<std::string, 3> wanted;
  double seconds = 0, spacing = 0.003, optic = -1;
  int threads = 1;
  std::vector<double> at;
  app.add_option("WAYPOINTS", waypoints, "as for trajectory_from_waypoints")->required();
  app.add_option("--scene", scene, "scene of vest_tissue, or a scene file");
  app.add_option("--seconds", seconds, "end earlier")->check(vest::files::number(0, 1e9));
  app.add_option("--threads", threads)->check(CLI::Range(1, 64));
  app.add_option("--fluid-spacing", spacing, "m, as of trainer.launch")
      ->check(vest::files::number(0.0005, 0.02));
  app.add_option("--left", wanted[0], "tool; else what the file says, else a grasper");
  app.add_option("--right", wanted[1], "tool; else what the file says, else a grasper");
  app.add_option("--third", wanted[2], "tool; else what the file says, else none");
  app.add_option("--optic", optic, "degrees, of the endoscope; else the box's")
      ->check(vest::files::number(0, 90));
  app.add_option("--bag", bag, "keeps moments for vest_render --each-state");
  app.add_option("--at", at, "moments (s) to keep; else the file's `pictures`")
      ->check(vest::files::number(0, 36000));  // as waypoints have them
  CLI11_PARSE(app, argc, argv);
  try {
    namespace simulation = vest::simulation;
    auto box = vest::kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") +
                                                "/config/trainer_box.yaml");
    if (optic >= 0)
      box.arms[static_cast<std::size_t>(vest::tools::Instrument::Endoscope)].optic_angle =
          optic * 0.017453292519943295;
    const auto trajectory = vest::trajectory::fromWaypoints(waypoints, box);
    simulation::Hands hands = simulation::handsOf(trajectory);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (wanted[i].empty()) continue;
      const auto tool = vest::tools::toolFromName(wanted[i]);
      if (!tool)
        throw std::invalid_argument("tool '" + wanted[i] + "' (allowed: " + vest::tools::handTools() + ")");
      hands.tool[i] = *tool;
    }
    std::unique_ptr<vest::ros_shell::MomentBag> moments;
    if (!bag.empty()) moments = std::make_unique<vest::ros_shell::MomentBag>(bag);
    simulation::StageOptions options;
    options.blood.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
    options.field_options.fluid.spacing = spacing;
    try {
      simulation::apply(trajectory.effects, options);
    } catch (const std::exception& e) {
      throw std::invalid_argument(waypoints + ": " + e.what());
    }
    const simulation::Stage stage = simulation::makeStage(
        vest::scene::World(vest::scene::loadScene(vest::ros_shell::sceneFile(scene)), threads), options,
        moments ? moments->frames() : simulation::StageFrames{});
    const vest::scene::World& world = stage.trainer->world();
    if (at.empty()) at = trajectory.pictures;
    auto next = at.cbegin();
    constexpr double kAboutNow = 1.5e-3;  // s, the step that ends at a moment, however it is rounded
    vest::scene::StepInput last;          // of a moment that waits for its surfaces
    double ended = 0;
    const auto keep = [&](double t, const auto& input, const auto&) {
      constexpr double kPatience = 0.2;  // s
      ended = t;
      for (; moments && next != at.cend() && t >= *next - kAboutNow; ++next) {
        last = input;
        if (t < *next || (!moments->current(world) && t < *next + kPatience)) break;
        moments->write(t, world, box, input);
      }
    };
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t worked = std::clock();
    const auto report = simulation::rehearse(*stage.trainer, box, trajectory, hands, seconds, keep);
    for (; next != at.cend() && moments && ended >= *next - kAboutNow; ++next)
      moments->write(ended, world, box, last);
    if (moments && next != at.cend())
      std::fprintf(stderr, "vest_rehearse: no picture of %g s and later: the motion ends at %g s\n", *next,
                   ended);
    if (moments) moments->close();
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const double processor = static_cast<double>(std::clock() - worked) / CLOCKS_PER_SEC;
    const auto steps = static_cast<double>(world.steps());
    tell(stage, report, 1e3 * wall / steps, 1e3 * processor / steps);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_rehearse: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  }
  return 0;
}

#include <chrono>
#include <cstdio>
#include <string>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_bringup/simulation/blood_effect.h"
#include "vest_bringup/simulation/operating_field.h"
#include "vest_bringup/simulation/rehearsal.h"
#include "vest_bringup/simulation/surface_effect.h"
#include "vest_bringup/simulation/trainer.h"

// Plays a scripted motion into a scene, faster than real time and without ROS: for authors of demos and
// exercises.
int main(int argc, char** argv) {
  CLI::App app{"Plays waypoints (YAML) into a scene and tells what happened to the tissue"};
  std::string waypoints, scene = "gynaecology", left, right, third;
  double seconds = 0;
  int threads = 1;
  app.add_option("WAYPOINTS", waypoints, "as for trajectory_from_waypoints")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--scene", scene, "scene of vest_tissue, or a scene file");
  app.add_option("--seconds", seconds, "end earlier")->check(CLI::NonNegativeNumber);
  app.add_option("--threads", threads)->check(CLI::Range(1, 64));
  app.add_option("--left", left, "tool; else what the file says, else a grasper");
  app.add_option("--right", right, "tool; else what the file says, else a grasper");
  app.add_option("--third", third, "tool; else what the file says, else none");
  CLI11_PARSE(app, argc, argv);
  try {
    using vest::tools::ToolKind;
    const auto kind = [](const std::string& word) {
      const auto tool = vest::tools::toolFromName(word);
      if (!tool) throw std::invalid_argument("tool '" + word + "' (allowed: none, grasper, scissors, …)");
      return *tool;
    };
    if (scene.find('/') == std::string::npos) {
      scene = ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
    }
    const auto box = vest::kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") +
                                                      "/config/trainer_box.yaml");
    const auto trajectory = vest::trajectory::fromWaypoints(waypoints, box);
    vest::simulation::Hands hands;
    const std::array<std::pair<std::string, ToolKind>, 3> wanted{
        {{left, ToolKind::Grasper}, {right, ToolKind::Grasper}, {third, ToolKind::None}}};
    for (std::size_t i = 0; i < wanted.size(); ++i)
      hands.tool[i] =
          wanted[i].first.empty() ? trajectory.tools[i].value_or(wanted[i].second) : kind(wanted[i].first);
    hands.tool[3] = ToolKind::Endoscope;
    hands.tray = trajectory.tool_tray;
    vest::simulation::Trainer trainer(vest::scene::World(vest::scene::loadScene(scene), threads));
    const vest::scene::World& world = trainer.world();
    vest::simulation::BloodOptions blood_options;
    blood_options.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
    auto blood = std::make_unique<vest::simulation::BloodEffect>(world, blood_options, nullptr);
    vest::simulation::BloodEffect* const circulation = blood.get();
    trainer.add(std::move(blood));
    trainer.add(std::make_unique<vest::simulation::SurfaceEffect>(world, vest::simulation::SurfaceOptions{},
                                                                  circulation, nullptr));
    auto effect =
        std::make_unique<vest::simulation::OperatingField>(world, vest::simulation::FieldOptions{}, nullptr);
    const vest::simulation::OperatingField& field = *effect;
    trainer.add(std::move(effect));
    const auto begin = std::chrono::steady_clock::now();
    const auto report = vest::simulation::rehearse(trainer, box, trajectory, hands, seconds);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    static const char* const kWords[] = {"grasped",   "released",   "slipped",   "cut",     "clipped",
                                         "unclipped", "coagulated", "punctured", "ligated", "torn",
                                         "knot tied", "perforated", "separated", "fault"};
    for (const auto& e : report.events) {
      const auto k = static_cast<std::size_t>(e.kind);
      std::printf("%7.3f s  %-9s %s by %d at [%.4f %.4f %.4f], %.3f N\n", 1e-3 * static_cast<double>(e.step),
                  k < std::size(kWords) ? kWords[k] : "other",
                  world.description().objects[e.object].name.c_str(), e.instrument, e.position.x(),
                  e.position.y(), e.position.z(), e.force);
    }
    std::printf(
        "%s moved %.1f mm; greatest force %.3f N; worst status %d; speed at the end %.2f mm/s; %.3f ms per "
        "step\n",
        report.tube.c_str(), 1e3 * report.tube_displacement, report.greatest_force,
        static_cast<int>(report.worst), 1e3 * report.settled_speed,
        1e3 * wall / static_cast<double>(world.steps()));
    const auto& f = field.fluid();
    std::printf(
        "fluid: %.2f ml emitted = %.2f particles + %.2f pools + %.2f sucked + %.2f lost; %zu particles\n",
        1e6 * f.emitted, 1e6 * vest::fluid::particleVolume(field.fluidModel(), f),
        1e6 * vest::fluid::poolVolume(field.fluidModel(), f), 1e6 * f.sucked, 1e6 * f.lost,
        f.particles.count);
    std::printf("smoke: %.3f mg made, %.3f there, %.3f drawn; lens: %.1f °C, %.2f g/m2 of condensate\n",
                1e6 * field.smoke().made, 1e6 * vest::smoke::mass(field.smokeModel(), field.smoke()),
                1e6 * field.smoke().drawn, field.lens().temperature - 273.15, 1e3 * field.lens().condensate);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_rehearse: %s\n", e.what());
    return 1;
  }
  return 0;
}

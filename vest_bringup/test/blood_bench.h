#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include <ros/package.h>

#include "vest_bringup/session/resimulation.h"
#include "vest_bringup/simulation/blood_effect.h"
#include "vest_bringup/simulation/surface_effect.h"
#include "vest_bringup/simulation/trainer.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_tissue/scene/world_model.h"

/// The blood effect alone, in the scene of the demo.
namespace vest::simulation {

namespace hd = haemodynamics;

inline scene::Description gynaecology() {
  static const scene::Description loaded =
      scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml");
  return loaded;
}

inline BloodOptions options() {
  BloodOptions o;
  o.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  return o;
}

inline std::uint16_t objectNamed(const scene::World& world, const std::string& name) {
  for (std::size_t i = 0; i < world.objectCount(); ++i)
    if (world.description().objects[i].name == name) return static_cast<std::uint16_t>(i);
  ADD_FAILURE() << name;
  return 0;
}

/// The effect alone, fed with events.
struct Bench {
  scene::World world{gynaecology()};
  BloodEffect effect{world, options(), nullptr};
  scene::StepInput input;
  scene::StepReport report;
  Feedback feedback;
  Bench() { feedback.sources.reserve(bleeding::kMostSources), feedback.dilatations.reserve(64); }
  void step() {
    feedback.sources.clear();
    feedback.dilatations.clear();
    effect.step(world, input, report, feedback);
    report.events.clear();
    input.edits.clear();
  }
  void event(scene::EventKind kind, const std::string& object, double station, double area) {
    scene::Event e;
    e.kind = kind;
    e.object = objectNamed(world, object);
    const auto& tube = world.model().objects[e.object].tube;
    e.station = station, e.area = area;
    if (std::isfinite(station)) e.position = world.knotAt(e.object, tube.knots(tube.nearestRing(station))[0]);
    report.events.push_back(e);
  }
};

}  // namespace vest::simulation

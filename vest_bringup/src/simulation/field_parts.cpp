#include "field_parts.h"

#include <algorithm>

#include "vest_instruments/tools/tool_geometry.h"

namespace vest::simulation {
namespace {

constexpr double kNozzle = 0.012;  ///< m behind the mouth of a nozzle: as far as it draws fluid

}  // namespace

double swabRadius() {
  return tools::toolGeometry(tools::ToolKind::Swab).fixed.front().radius;
}

void placeObstacles(const scene::StepInput& input, const scene::StepReport& report, fluid::Inputs& in) {
  in.obstacle_count = 0;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const scene::ToolInput& tool = input.tools[t];
    if (!tool.present || tool.tool == tools::ToolKind::None || tool.tool == tools::ToolKind::Endoscope)
      continue;
    const tools::ToolGeometry& g = tools::toolGeometry(tool.tool);
    const Eigen::Isometry3d tip = tipOf(input, report, t);
    const auto add = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius) {
      if (in.obstacle_count >= fluid::kMostObstacles) return;
      fluid::Obstacle& o = in.obstacles[static_cast<std::size_t>(in.obstacle_count++)];
      o.a = triple(a), o.b = triple(b), o.radius = radius;
    };
    const Eigen::Vector3d jaws(0, 0, -g.jaw_length);
    const bool nozzle = (tool.functions & (tools::kFunctionIrrigate | tools::kFunctionSuck)) != 0;
    add(tool.pivot, tip * (nozzle ? Eigen::Vector3d(0, 0, -kNozzle) : jaws), g.shaft_radius);
    if (nozzle) continue;
    for (const auto& part : g.fixed) add(tip * part.a, tip * part.b, part.radius);
    for (const auto& half : g.jaw)
      for (const auto& part : half) add(tip * (jaws + part.a), tip * (jaws + part.b), part.radius);
  }
}

void copyShown(const fluid::State& from, fluid::State& to) {
  to.step = from.step, to.time = from.time;
  const fluid::Particles& p = from.particles;
  to.particles.count = p.count;
  for (auto a :
       {&fluid::Particles::x, &fluid::Particles::y, &fluid::Particles::z, &fluid::Particles::vx,
        &fluid::Particles::vy, &fluid::Particles::vz, &fluid::Particles::volume, &fluid::Particles::blood})
    std::copy_n((p.*a).begin(), p.count, (to.particles.*a).begin());
  for (auto a : {&fluid::Pools::bed, &fluid::Pools::depth, &fluid::Pools::blood, &fluid::Pools::rise,
                 &fluid::Pools::raised, &fluid::Pools::film, &fluid::Pools::film_age, &fluid::Pools::ground})
    to.pools.*a = from.pools.*a;
  to.bubbles = from.bubbles;
  to.pending = from.pending;
  to.emitted = from.emitted, to.emitted_blood = from.emitted_blood;
  to.sucked = from.sucked, to.sucked_blood = from.sucked_blood, to.lost = from.lost;
  to.stained = from.stained, to.soaked = from.soaked;
}

}  // namespace vest::simulation

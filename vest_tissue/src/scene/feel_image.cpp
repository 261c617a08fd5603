#include <algorithm>
#include <cmath>
#include <limits>

#include "stages.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_tissue/scene/fill_record.h"
#include "vest_tissue/voxel/volume.h"

namespace vest::scene {

voxel::Kind feelsAs(tools::ToolKind tool) noexcept {
  switch (tool) {
    case tools::ToolKind::None:
    case tools::ToolKind::Endoscope:
      return voxel::Kind::None;
    case tools::ToolKind::InjectionNeedle:
      return voxel::Kind::Needle;
    default:
      return voxel::Kind::Probe;
  }
}

double reachOf(tools::ToolKind tool) noexcept {
  const tools::ToolGeometry& geometry = tools::toolGeometry(tool);
  return geometry.interaction_points.empty() ? 0.0 : std::max(0.0, geometry.interaction_points[0].z());
}

void feelImage(Context& c) {
  const Description& d = c.model.description;
  if (!d.feel) return;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const ToolInput& input = c.input.tools[t];
    voxel::Motion motion;
    motion.kind = input.present ? feelsAs(input.tool) : voxel::Kind::None;
    motion.tip = input.position;
    motion.pivot = input.pivot;
    motion.reach = reachOf(input.tool);
    motion.dt = c.dt;
    const voxel::Felt felt = voxel::step(d.feel->view(), motion, c.state.in_image[t]);
    ContactModel& m = c.report.contacts[t];
    const bool touched = felt.force.squaredNorm() > 0.0;
    m.image = felt.force;
    m.image_alone = touched && !m.in_contact;
    m.in_contact = m.in_contact || touched;
    m.wrench.head<3>() += felt.force;
    if (motion.kind != voxel::Kind::Needle) continue;
    const auto tell = [&](EventKind kind, std::uint8_t region, double force) {
      if (region == 0 || region > d.regions.size()) return;
      Event e;
      e.kind = kind;
      e.step = c.state.step;
      e.instrument = static_cast<std::int8_t>(t);
      e.object = d.regions[region - 1u];
      e.position = felt.tip;
      e.station = e.area = std::numeric_limits<double>::quiet_NaN();
      e.force = force;
      emit(c, e);
    };
    const double force = felt.broke > 0.0 ? felt.broke : std::sqrt(felt.force.squaredNorm());
    tell(EventKind::Exited, felt.left, force);
    tell(EventKind::Punctured, felt.entered, force);
  }
}

}  // namespace vest::scene

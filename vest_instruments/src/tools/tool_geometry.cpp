#include "vest_instruments/tools/tool_geometry.h"

#include <cstddef>

namespace vest::tools {
namespace {

using Eigen::Vector3d;

// All sizes below are those of common 5 mm laparoscopic instruments: the shaft's 5 mm (endoscope 10 mm) are
// the trade's standard port sizes; lengths and openings of the jaws are assumed, within what catalogues show
// (jaws 10–25 mm, openings 30–70 degrees), because no single published source lists all of them.

/// Closed jaws meet in the plane x = 0 and end at z = length: each is a capsule that leans on that plane.
/// @param thickness m, of one jaw at its axis and at its point
void addJaws(ToolGeometry& tool, double length, double max_angle, double radius_base, double radius_point) {
  tool.jaw_length = length;
  tool.max_jaw_angle = max_angle;
  const double middle = 0.5 * length;
  for (int side = 0; side < 2; ++side) {
    const double s = side == 0 ? 1.0 : -1.0;
    auto& capsules = tool.jaw[static_cast<std::size_t>(side)];
    capsules.push_back(
        {Vector3d(s * radius_base, 0, radius_base), Vector3d(s * radius_base, 0, middle), radius_base});
    capsules.push_back({Vector3d(s * radius_point, 0, middle),
                        Vector3d(s * radius_point, 0, length - radius_point), radius_point});
  }
  for (int i = 0; i < 4; ++i) tool.interaction_points.emplace_back(0, 0, -0.25 * i * length);
}

ToolGeometry make(ToolKind kind) {
  ToolGeometry tool;
  tool.kind = kind;
  switch (kind) {
    case ToolKind::None:
      break;
    case ToolKind::Grasper:  // fenestrated, atraumatic; opening 60 degrees (assumed)
      addJaws(tool, 0.022, 1.05, 0.0012, 0.0010);
      break;
    case ToolKind::Scissors:  // Metzenbaum; opening 45 degrees (assumed)
      addJaws(tool, 0.017, 0.80, 0.0010, 0.0006);
      break;
    case ToolKind::ClipApplier:  // holds a medium-large clip of about 8 mm; opening 35 degrees (assumed)
      addJaws(tool, 0.014, 0.60, 0.0012, 0.0012);
      break;
    case ToolKind::CoagulationHook: {  // L-hook: ceramic neck, wire of 1.2 mm, foot of 4 mm towards +x
                                       // (assumed)
      const double wire = 0.0006;
      tool.fixed.push_back({Vector3d(0, 0, 0), Vector3d(0, 0, 0.004), 0.0015});
      tool.fixed.push_back({Vector3d(0, 0, 0.004), Vector3d(0, 0, 0.014), wire});
      tool.fixed.push_back({Vector3d(0, 0, 0.014), Vector3d(0.004, 0, 0.014), wire});
      tool.interaction_points = {Vector3d(0.004, 0, 0.014), Vector3d(0.002, 0, 0.014), Vector3d(0, 0, 0.014),
                                 Vector3d(0, 0, 0.009)};
      break;
    }
    case ToolKind::BipolarForceps:  // flat paddles; opening 50 degrees (assumed)
      addJaws(tool, 0.018, 0.87, 0.0011, 0.0010);
      break;
    case ToolKind::NeedleHolder:  // short strong jaws with carbide inserts; opening 45 degrees (assumed)
      addJaws(tool, 0.013, 0.80, 0.0013, 0.0010);
      break;
    case ToolKind::SuctionIrrigator:  // open tube of the shaft's width with side holes
      tool.interaction_points = {Vector3d(0, 0, 0), Vector3d(0, 0, -0.004), Vector3d(0, 0, -0.008),
                                 Vector3d(0, 0, -0.012)};
      break;
    case ToolKind::InjectionNeedle:  // 20 gauge: 0.908 mm outside (ISO 9626); 20 mm of it free (assumed)
      tool.fixed.push_back({Vector3d(0, 0, 0), Vector3d(0, 0, 0.0195), 0.000454});
      tool.interaction_points = {Vector3d(0, 0, 0.02), Vector3d(0, 0, 0.015), Vector3d(0, 0, 0.010),
                                 Vector3d(0, 0, 0.005)};
      break;
    case ToolKind::SlingApplicator:  // knot pusher beyond an introducer tube; its loop is a suture (assumed)
      tool.fixed.push_back({Vector3d(0, 0, 0), Vector3d(0, 0, 0.010), 0.0012});
      tool.interaction_points = {Vector3d(0, 0, 0.0112), Vector3d(0, 0, 0.0075), Vector3d(0, 0, 0.0038),
                                 Vector3d(0, 0, 0)};
      break;
    case ToolKind::Endoscope:  // 10 mm Hopkins type rod-lens optic
      tool.shaft_radius = 0.005;
      break;
    case ToolKind::Swab:  // gauze of 2 x 2 inches, folded lengthwise over closed jaws: a wad of 3.6 ml, as
                          // large as what it holds when it is soaked (bleeding/swab.h); its shape: assumed
      tool.fixed.push_back({Vector3d(0, 0, 0.004), Vector3d(0, 0, 0.018), 0.007});
      tool.interaction_points = {Vector3d(0, 0, 0.018), Vector3d(0, 0, 0.013), Vector3d(0, 0, 0.008),
                                 Vector3d(0, 0, 0.004)};
      break;
  }
  return tool;
}

struct Catalogue {
  std::array<ToolGeometry, kToolKindCount> tools;
  Catalogue() {
    for (int i = 0; i < kToolKindCount; ++i)
      tools[static_cast<std::size_t>(i)] = make(static_cast<ToolKind>(i));
  }
};

}  // namespace

const ToolGeometry& toolGeometry(ToolKind kind) {
  static const Catalogue catalogue;
  const auto i = static_cast<std::size_t>(kind);
  return catalogue.tools[i < catalogue.tools.size() ? i : 0];
}

}  // namespace vest::tools

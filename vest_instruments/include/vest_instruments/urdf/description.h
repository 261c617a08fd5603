#pragma once

#include <array>
#include <stdexcept>
#include <string>

#include "vest_instruments/files/read.h"
#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::urdf {

/// A URDF that must not reach the URDF library; what() says why.
class UrdfError : public std::runtime_error {
 public:
  explicit UrdfError(const std::string& why) : std::runtime_error(files::shown(why, 300)) {}
};

using ToolSet = std::array<tools::ToolKind, tools::kInstrumentCount>;

/// URDF of box, trocars and instruments. Links: world → phantom_box → NAME_trocar → NAME_yaw → NAME_pitch →
/// NAME_insertion → NAME_roll → NAME_tip → NAME_jaw (massless) → NAME_jaw_left, NAME_jaw_right, and for the
/// endoscope endoscope_tip → endoscope_light_post → endoscope_optic → endoscope_optical_frame. Joints bear
/// the names of joint_states. The same links exist for every tool, so that an exchange changes no frame's
/// name. Visuals are meshes of this package, collision geometry the capsules of tools::ToolGeometry as
/// cylinders.
std::string makeUrdf(const kinematics::TrainerBox& box, const ToolSet& tools);

/// Refuses what urdfdom 3.0.1 crashes on or accepts wrongly: more than 4 MB, elements nested deeper than 64,
/// a link with two parents, a cycle, none or several roots, joints between unknown links. Call it before
/// urdfdom.
/// @throws UrdfError
void checkUrdf(const std::string& xml);

}  // namespace vest::urdf

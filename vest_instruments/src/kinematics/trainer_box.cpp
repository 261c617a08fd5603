#include "vest_instruments/kinematics/trainer_box.h"

#include <cmath>

#include "../yaml/field.h"
#include "vest_instruments/tools/tool_names.h"

namespace vest::kinematics {
namespace {

using Eigen::Vector3d;
using yaml::Field;
using yaml::loadFile;

void readLimit(const Field& limits, const char* name, double least, double most, double& lower,
               double& upper) {
  const Field f = limits.at(name);
  if (!f.node.IsSequence() || f.node.size() != 2) f.refuse("'" + f.text() + "'", "[lower, upper]");
  lower = f.element(0).number(least, most);
  upper = f.element(1).number(least, most);
  if (!(lower < upper)) f.refuse("lower is not below upper", "[lower, upper] with lower < upper");
}

TrainerArm readArm(const Field& f, tools::Instrument instrument, const JointLimits& limits) {
  TrainerArm arm;
  arm.present = true;
  arm.limits = limits;
  const bool endoscope = instrument == tools::Instrument::Endoscope;
  if (endoscope) {
    f.onlyKeys({"pivot", "aim", "optic_angle"});
    arm.tool = tools::ToolKind::Endoscope;
    arm.optic_angle = f.at("optic_angle").number(0.0, 1.6);
    arm.limits.lower.jaw = -M_PI;  // light_post turns all the way
    arm.limits.upper.jaw = M_PI;
  } else {
    f.onlyKeys({"pivot", "aim", "tool"});
    const Field tool = f.at("tool");
    const auto kind = tool.node.IsScalar() ? tools::toolFromName(tool.node.Scalar()) : std::nullopt;
    if (!kind || *kind == tools::ToolKind::Endoscope) {
      tool.refuse("'" + tool.text() + "'", tools::handTools());
    }
    arm.tool = *kind;
  }
  arm.pivot_B = f.at("pivot").vector(-2.0, 2.0);
  arm.aim_B = f.at("aim").vector(-2.0, 2.0);
  try {
    arm.X_BTrocar = trocarFrame(arm.pivot_B, arm.aim_B);
  } catch (const files::FileError& e) {
    f.at("aim").refuse(e.what(), "a point away from the pivot, and not straight to its side");
  }
  return arm;
}

}  // namespace

Eigen::Isometry3d trocarFrame(const Vector3d& pivot_B, const Vector3d& aim_B) {
  const Vector3d along = aim_B - pivot_B;
  if (!along.allFinite() || along.norm() < 1e-6) throw files::FileError("aim and pivot coincide");
  const Vector3d z = along.normalized();
  const Vector3d side = Vector3d::UnitX() - z.x() * z;
  if (side.norm() < 1e-3) throw files::FileError("the shaft lies along x");
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear().col(0) = side.normalized();
  X.linear().col(1) = z.cross(side.normalized());
  X.linear().col(2) = z;
  X.translation() = pivot_B;
  return X;
}

Eigen::Isometry3d tiltedBox(double about_x, double about_y) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = (Eigen::AngleAxisd(about_x, Vector3d::UnitX()) * Eigen::AngleAxisd(about_y, Vector3d::UnitY()))
                   .toRotationMatrix();
  return X;
}

TrainerBox loadTrainerBox(const std::string& path) {
  const Field root = loadFile(path);
  try {
    root.onlyKeys({"box", "limits", "instruments"});
    TrainerBox box;
    const Field f = root.at("box");
    f.onlyKeys({"inside", "dome"});
    box.inside = f.at("inside").vector(0.05, 2.0);
    box.dome = f.at("dome").number(0.0, 0.5);

    const Field l = root.at("limits");
    l.onlyKeys({"yaw", "pitch", "insertion", "roll", "jaw"});
    JointLimits limits;
    readLimit(l, "yaw", -1.57, 1.57, limits.lower.yaw, limits.upper.yaw);
    readLimit(l, "pitch", -1.57, 1.57, limits.lower.pitch, limits.upper.pitch);
    readLimit(l, "insertion", 0.0, 1.0, limits.lower.insertion, limits.upper.insertion);
    readLimit(l, "roll", -100.0, 100.0, limits.lower.roll, limits.upper.roll);
    readLimit(l, "jaw", 0.0, M_PI, limits.lower.jaw, limits.upper.jaw);

    const Field instruments = root.at("instruments");
    instruments.onlyKeys({"left", "right", "third", "endoscope"});
    for (int i = 0; i < tools::kInstrumentCount; ++i) {
      const auto instrument = static_cast<tools::Instrument>(i);
      const std::string name(tools::instrumentName(instrument));
      if (instrument == tools::Instrument::Third && !instruments.node[name]) continue;
      box.arms[static_cast<std::size_t>(i)] = readArm(instruments.at(name.c_str()), instrument, limits);
    }
    return box;
  } catch (const YAML::Exception& e) {
    throw files::FileError(path + ": line " + std::to_string(e.mark.line + 1) + ": " + e.msg +
                           "; allowed: a layout");
  }
}

}  // namespace vest::kinematics

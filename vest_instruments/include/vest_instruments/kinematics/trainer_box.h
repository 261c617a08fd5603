#pragma once

#include <array>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "vest_instruments/files/file_error.h"
#include "vest_instruments/kinematics/arm.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::kinematics {

/// One instrument of the box. Frame B is phantom_box.
struct TrainerArm {
  bool present = false;  ///< false: this box has no such instrument, the rest is meaningless
  Eigen::Vector3d pivot_B = Eigen::Vector3d::Zero();            ///< m
  Eigen::Vector3d aim_B = Eigen::Vector3d::Zero();              ///< m, on the shaft's axis at zero angles
  Eigen::Isometry3d X_BTrocar = Eigen::Isometry3d::Identity();  ///< origin at the pivot, z towards the aim
  JointLimits limits;
  tools::ToolKind tool = tools::ToolKind::None;  ///< at start
  double optic_angle = 0.0;                      ///< rad, endoscope only
};

/// Layout of a trainer box (config/trainer_box.yaml).
struct TrainerBox {
  Eigen::Vector3d inside{0.36, 0.44, 0.20};              ///< m: width x, depth y, height z of the lid's rim
  double dome = 0.03;                                    ///< m: rise of the lid's middle above its rim
  std::array<TrainerArm, tools::kInstrumentCount> arms;  ///< in the order of tools::Instrument

  const TrainerArm& arm(tools::Instrument i) const { return arms[static_cast<std::size_t>(i)]; }
};

/// Trocar frame of an instrument: z from pivot to aim, x = world x made orthogonal to z, y = z × x.
/// @throws files::FileError where aim and pivot coincide or z lies along x.
Eigen::Isometry3d trocarFrame(const Eigen::Vector3d& pivot_B, const Eigen::Vector3d& aim_B);

/// phantom_box in world where the box stands tilted: turned about its own x, then about its own y that came
/// along, R = Rx(about_x) · Ry(about_y). Radians. Whoever needs the tilt takes it from here.
Eigen::Isometry3d tiltedBox(double about_x, double about_y);

/// Reads a layout. Strict: unknown or missing keys, wrong types, non-finite and out-of-range numbers are
/// errors. Files over 64 KiB and YAML with anchors or aliases are refused before they are parsed.
/// @throws files::FileError
TrainerBox loadTrainerBox(const std::string& path);

}  // namespace vest::kinematics

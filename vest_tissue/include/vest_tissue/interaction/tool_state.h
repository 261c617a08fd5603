#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Geometry>

#include "vest_instruments/tools/tool_geometry.h"

namespace vest::interaction {

/// Coupling of the commanded tip to the proxy that touches the tissue: spring, damper, mass of the proxy.
/// Stiffness: the order of a 5 mm steel shaft bent over 0.15 m between trocar and tip (3EI/L³, tube of 5
/// × 4.4 mm: about 2.2 kN/m). Mass: assumed, the order of a laparoscopic instrument's distal half. Damping:
/// critical.
inline constexpr double kCouplingStiffness = 2000.0;  ///< N/m
inline constexpr double kProxyMass = 0.05;            ///< kg
inline constexpr double kCouplingDamping = 20.0;      ///< N·s/m = 2·sqrt(k·m)
inline constexpr double kProxySpeedLimit = 2.0;  ///< m/s: faster commands are followed late (no tunnelling)
inline constexpr double kJawSpeedLimit = 12.0;   ///< rad/s
/// N at the middle of the jaws: more than this a hand does not close them with, and more they do not give way
/// to. Peak pinch of graspers in use (Barrie 2013: 20.5 N, range 10.2 to 35.2), taken for every kind of jaws.
inline constexpr double kJawForceLimit = 20.5;

/// Pose of a tool: tip frame of tools::ToolGeometry, the trocar's pivot and the jaw.
struct ToolPose {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();                    ///< m, world
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< tip frame in world
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();                  ///< m, world
  double jaw = 0.0;                                                 ///< rad
};

/// State of one instrument's proxy.
struct Proxy {
  bool present = false;
  tools::ToolKind tool = tools::ToolKind::None;
  ToolPose pose;                                        ///< at the end of the last step
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();   ///< m/s, of the tip
  Eigen::Vector3d commanded = Eigen::Vector3d::Zero();  ///< m, of the last step
  Eigen::Vector3d force = Eigen::Vector3d::Zero();      ///< N, tissue on tool, mean over the last step
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();     ///< N·m about the tip
  Eigen::Vector3d tip_force = Eigen::Vector3d::Zero();  ///< N, what of it the tip feels through the pivot
  double jaw_torque = 0.0;     ///< N·m: what tissue that the jaws push on does to them; positive opens
  double jaw_stiffness = 0.0;  ///< N·m/rad: how it grows as they close
};

/// No tissue touches it.
inline void clearForces(Proxy& proxy) {
  proxy.force.setZero(), proxy.torque.setZero(), proxy.tip_force.setZero();
  proxy.jaw_torque = proxy.jaw_stiffness = 0.0;
}

/// Turns `orientation` by the smallest rotation that makes its z axis point from pivot to tip.
Eigen::Quaterniond throughPivot(const Eigen::Quaterniond& orientation, const Eigen::Vector3d& pivot,
                                const Eigen::Vector3d& tip);

inline constexpr int kMaxToolCapsules = 24;

/// Sine and cosine of half an opening angle (rad) by their series: the same bits everywhere.
struct HalfAngle {
  double sine, cosine;
};
HalfAngle halfAngle(double jaw);

/// A tool's capsules in world at a pose. Which: -1 shaft and fixed parts, 0 and 1 the jaws.
struct PlacedCapsule {
  Eigen::Vector3d a, b;  ///< m, world
  double radius;
  int which;
};
/// Fills at most kMaxToolCapsules and returns how many.
int placeCapsules(const tools::ToolGeometry& geometry, const ToolPose& pose, PlacedCapsule* out);

}  // namespace vest::interaction

#pragma once

#include <cstdint>

#include <Eigen/Core>

/// Where blood (or, from other effects, water) enters the operating field: what bleeding tells the fluid.
namespace vest::bleeding {

/// Most sources that live at a time; `slot` is below it. Two of a vessel's holes (both ends of a cut), organ
/// surfaces and instruments share it (assumed).
constexpr int kMostSources = 128;
constexpr double kSuckReach = 0.004;       ///< m around a suction tip: clots there come off (assumed)
constexpr double kClotThickness = 0.0005;  ///< m: of a clot on a surface that oozed (assumed)

/// One source during one step: volume flow·dt enters, spread over `area` at `position`, with the mean speed
/// flow/area along `direction`. A reader that keeps an account per `slot` of what it has not yet turned into
/// particles loses nothing. World frame, SI.
struct FluidSource {
  std::uint16_t slot = 0;                                ///< 0 … kMostSources − 1, fixed while it lives
  std::uint32_t wound = 0;                               ///< counts openings since the start, from 1; 0: none
  std::int16_t vessel = -1;                              ///< segment of the vessel network, −1: none
  std::int32_t object = -1;                              ///< object of the scene, −1: none
  Eigen::Vector3d position = Eigen::Vector3d::Zero();    ///< m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector, out of the opening
  double area = 0;                                       ///< m², > 0: what the flow passes through
  double flow = 0;                                       ///< m³/s, mean of the step, ≥ 0
  double blood_fraction = 1;                             ///< no unit: 1 blood, 0 water
};

}  // namespace vest::bleeding

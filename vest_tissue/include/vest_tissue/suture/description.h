#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

/// Threads as elastic rods, and the rigid cylinders that they touch: what a scene says, as plain data.
/// Any consistent unit system; the units in comments are SI. Frame: world.
namespace vest::suture {

using Index = std::uint32_t;

/// A round, homogeneous cross-section.
struct Section {
  double radius = 0.0;          ///< m, of the surface that touches
  double linear_density = 0.0;  ///< kg/m
  double stretch = 0.0;         ///< EA, N
  double shear = 0.0;           ///< GA, N
  double bend = 0.0;            ///< EI, N·m²
  double twist = 0.0;           ///< GJ, N·m²
  double friction = 0.0;        ///< Coulomb, with itself and others: of two that touch the greater counts
  double damping = 0.0;         ///< 1/s, of momentum and spin
  double drag = 0.0;            ///< N·s/m², of the medium, per length
  double strain_damping = 0.0;  ///< s: stress = C·(strain + strain_damping·strain rate)
  double yield_moment = 0.0;    ///< N·m: bending beyond it stays; 0: never
  /// How much of `friction` is lost as threads press harder on each other, and the pressure, N/m², at which
  /// half of that is lost: suture::Friction. 0: nothing.
  double friction_fall = 0.0, friction_pressure = 0.0;
};

/// @param poisson_ratio of the solid material, 0 … 0.5 @return EA, GA, EI, GJ and ρA of a solid round rod
Section solidSection(double radius, double density, double youngs_modulus, double poisson_ratio);

enum class Hold : std::uint8_t { Free = 0, Place = 1, Frame = 2 };

/// Where a held node is at a time.
struct DriveRow {
  double t = 0.0;  ///< s
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double angle = 0.0;  ///< rad, of a held frame about the rod's axis there, added to the start
};

struct HeldNode {
  Index node = 0;
  Hold hold = Hold::Place;
  /// Ascending in t, linear between rows; before the first row from the start, after the last at rest there.
  std::vector<DriveRow> drive;
};

struct NodeLoad {
  Index node = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, dead
};

/// A rigid needle at the first end of a thread.
struct Needle {
  std::vector<Eigen::Vector3d> points;  ///< m, at the start: tip to swage, evenly; none: no needle
  double radius = 0.0;                  ///< m, of the wire
  double density = 0.0;                 ///< kg/m³
  double swage = 0.0;                   ///< N: the thread leaves it beyond that
};

struct RodDescription {
  std::string name;
  std::vector<Eigen::Vector3d> nodes;  ///< m, at the start; their distances are the rest lengths
  bool closed = false;                 ///< a segment joins the last node and the first
  Section section;
  bool natural_shape = false;  ///< curvature of `nodes` is without stress; else the rod is straight by nature
  double turn = 0.0;           ///< rad, twist put in, spread evenly
  std::vector<HeldNode> held;
  std::vector<NodeLoad> loads;
  Needle needle;  ///< its last point is the first node
};

/// Rigid, without ends, does not move.
struct Cylinder {
  std::string name;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< any length but zero
  double radius = 0.0;
  double friction = 0.0;
};

struct Description {
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< m/s²
  std::vector<RodDescription> rods;
  std::vector<Cylinder> cylinders;
};

}  // namespace vest::suture

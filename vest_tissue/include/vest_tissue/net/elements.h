#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/net/link_kernel.h"

namespace vest::net {

/// The slower elements of a net: stateless functions over flat arrays. Their forces are evaluated once per
/// batch of sub-steps, at the positions predicted for its middle, and held (docs/decisions/0011-…). Energies
/// are those whose negative gradient the forces are; tests check each by finite differences.

/// Bending link, from an energy: E = ½·k·(beta - beta0)², where beta = pi
/// - alpha is the deviation from straight and alpha the angle at knot b between the arms to a and c. Forces
/// and torques sum to zero. Where beta0 > 0 the direction at the straight angle is undefined: the force fades
/// to zero over 1e-3 rad.
struct Bending {
  std::uint32_t a, b, c;
  float stiffness;  ///< N·m/rad
  float rest;       ///< beta0, rad
};

/// Hinge (scene::HingeElement): E = k·(fold - fold0)², fold = 2·tan(theta/2), theta the dihedral deviation
/// from flat: for small theta the angle itself, and it stiffens towards a closed fold instead of passing
/// through. Needs no arctangent. Beyond kGreatestFold (theta = 127°) the moment stays.
struct Hinge {
  std::uint32_t edge0, edge1, wing0, wing1;
  float stiffness;  ///< N·m
  float rest;       ///< fold0, no unit
  float least = 0;  ///< m²: square of the wings' height below which the moment's forces fade, so that a
                    ///< crushed triangle does not turn a moment into any force; 0: none
};
inline constexpr float kGreatestFold = 4.0f;

/// Plastic link: +kappa beyond the rest length, -kappa below; the jump is spread over 2
/// % of the rest length (assumed), so that its tangent is bounded.
struct Plastic {
  std::uint32_t a, b;
  float kappa;    ///< N
  float rest;     ///< m
  float damping;  ///< N·s/m along the link
};
inline constexpr float kPlasticWidth = 0.02f;

/// Spring to a place (scene::Tether).
struct Tether {
  std::uint32_t knot;
  std::array<float, 3> place;  ///< m, world
  float stiffness;             ///< N/m
  float damping;               ///< N·s/m
};

/// Volume: E = ½·K·(V - V0)²/V0 over a closed surface. Beyond kGreatestCompression of V0, where an explicit
/// step could no longer hold K, the pressure stays (assumed; docs/decisions/0012-…): the energy goes on along
/// its tangent.
struct Volume {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> knots;  ///< that occur in the triangles, ascending
  float bulk_modulus = 0.0f;         ///< Pa
  float rest = 0.0f;                 ///< V0, m³
};

inline constexpr float kGreatestCompression = 0.25f;
/// Pressure of a volume V in the surface, Pa, > 0 where it is compressed.
inline float pressureOf(const Volume& v, double volume) {
  const double strain = (volume - v.rest) / v.rest;
  const double most = kGreatestCompression;
  return static_cast<float>(-v.bulk_modulus * (strain > most ? most : strain < -most ? -most : strain));
}

struct Elements {
  std::vector<Bending> bending;
  std::vector<Hinge> hinges;
  std::vector<Plastic> plastic;
  std::vector<Tether> tethers;
  std::vector<Volume> volumes;
};

/// x, y, z of the positions and of the velocities, f: forces are added to it. Arrays over the object's knots.
struct ElementArrays {
  const float *x, *y, *z;     ///< m, where elastic forces are taken
  const float *vx, *vy, *vz;  ///< m/s
  float *fx, *fy, *fz;        ///< N
};

void addBending(const std::vector<Bending>& elements, const ElementArrays& a);
void addHinges(const std::vector<Hinge>& elements, const ElementArrays& a, KernelLevel level);
void addPlastic(const std::vector<Plastic>& elements, const ElementArrays& a);
void addTethers(const std::vector<Tether>& elements, const ElementArrays& a);
void addVolumes(const std::vector<Volume>& elements, const ElementArrays& a);
/// All but volumes, which the solver renews once a step (volumeGradient).
void addElements(const Elements& elements, const ElementArrays& a, KernelLevel level);

/// A knot of a volume element: place from its first knot, m, and gradient; scratch of volumeGradient.
using Four = float __attribute__((vector_size(16)));  ///< of gcc and clang; the last of them is 0
struct PackedKnot {
  Four x, gradient;
};
/// Volume of one element and its gradient (m², three rows of `stride` floats, written for its knots): dV/dx
/// of each knot. `packed`: room for all knots of the object.
double volumeGradient(const Volume& volume, const ElementArrays& a, float* gradient, std::size_t stride,
                      std::vector<PackedKnot>& packed);

/// J, at positions a.x, a.y, a.z.
double bendingEnergy(const std::vector<Bending>& elements, const ElementArrays& a);
double hingeEnergy(const std::vector<Hinge>& elements, const ElementArrays& a);
double plasticEnergy(const std::vector<Plastic>& elements, const ElementArrays& a);
double tetherEnergy(const std::vector<Tether>& elements, const ElementArrays& a);
double volumeEnergy(const std::vector<Volume>& elements, const ElementArrays& a);
double elementEnergy(const Elements& elements, const ElementArrays& a);
/// W: what the dampers of tethers and plastic links turn into heat, >= 0.
double elementDissipation(const Elements& elements, const ElementArrays& a);

/// Fold of a hinge, 2·tan(theta/2), within ± kGreatestFold.
double foldOf(const Eigen::Vector3d& e0, const Eigen::Vector3d& e1, const Eigen::Vector3d& w0,
              const Eigen::Vector3d& w1);
/// Volume of a closed surface, m³ (double).
double enclosedVolume(const Volume& volume, const ElementArrays& a);

/// Angle of the vector (c, s) against (1, 0), -pi … pi, rad; error below 2e-6. No libm: the same bits
/// everywhere.
float angleOf(float s, float c);

}  // namespace vest::net

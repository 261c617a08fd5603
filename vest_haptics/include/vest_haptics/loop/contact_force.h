/// The force between two updates of the simulation: the newest local model, extrapolated to where the hand
/// is.
#pragma once

#include <Eigen/Core>

#include "vest_tissue/shared/contact_memory.h"

namespace vest::haptics {

/// A record of the shared memory, checked. World frame, SI. Only the translational part is extrapolated.
struct TissueModel {
  bool present = false;                                 ///< the instrument is in the scene
  bool arrived = true;                                  ///< its proxy has come to where it was asked for
  bool active = false;                                  ///< something touches or holds the instrument
  bool grasping = false;                                ///< bilateral
  Eigen::Vector3d position = Eigen::Vector3d::Zero();   ///< m, x0
  Eigen::Vector3d commanded = Eigen::Vector3d::Zero();  ///< m
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();   ///< m/s, v0
  Eigen::Vector3d force = Eigen::Vector3d::Zero();      ///< N, at x0 and v0
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();     ///< N·m about the tip
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();  ///< N/m, symmetric part
  Eigen::Matrix3d damping = Eigen::Matrix3d::Zero();    ///< N·s/m, symmetric part
  int planes = 0;
  Eigen::Vector3d normal[shared::kContactPlanes];
  double offset[shared::kContactPlanes] = {};      ///< m
  double plane_stiffness[shared::kContactPlanes];  ///< N/m: each plane's share of K along its normal
  double radius = 0.0;                             ///< m
  double jaw_torque = 0.0;                         ///< N·m
};

/// Greatest values believed of a simulation; beyond them, or where a number is not finite, or a stiffness or
/// damping has a negative diagonal, the record is refused (it would be a fault, not a force).
inline constexpr double kMostStiffness =
    1e9;  ///< N/m, assumed: sums of penalty contacts reach some MN/m; the coupling bounds what is shown
inline constexpr double kMostForce = 1e4;  ///< N, assumed
/// m, assumed: a proxy further from where it was asked for is on its way. A force that opens the gate holds
/// it 0.1 mm away (5 % of 3.3 N on kCouplingStiffness); a hand of 0.2 m/s runs 2 mm ahead of an input at 100
/// Hz.
inline constexpr double kArrived = 0.003;
/// @param why where it is refused: which field, a text that lives for ever; may be null
bool toModel(const shared::ContactRecord& record, TissueModel& model, const char** why = nullptr) noexcept;

/// Force at the tip that the hand should feel, from the newest model.
///
///   hand x ──[coupling Kc]── p ──[tissue F0 − K (p − x0) − B (v − v0)]
///
/// p is in equilibrium between the two; so the stiffness shown never exceeds Kc, and with Kc that of the
/// simulation's own coupling the force equals the simulation's where the hand stands still. A new model adds
/// no jump: what it would change at once decays with kBlend instead.
///
/// p is a constraint proxy (Zilles and Salisbury, "A constraint-based god-object method for haptic display",
/// IROS 1995) on the model's unilateral planes: tissue that is not held pushes and does not pull, each
/// surface for itself, and friction ends where the push ends. On rigid planes p is the point of free space
/// nearest to the hand; where they give way, each plane does by its share of K.
class ContactForce {
 public:
  static constexpr double kBlend = 0.003;        ///< s, tuned: three updates of a simulation of 1 kHz
  static constexpr double kMostDamping = 10.0;   ///< N·s/m shown by contact, tuned
  static constexpr double kExtraFriction = 0.3;  ///< beyond the model's ratio of friction to push, tuned

  /// Another Kc, N/m, from now on; no jump.
  void couple(double coupling, const Eigen::Vector3d& x, const Eigen::Vector3d& v) noexcept;
  /// @param coupling N/m, Kc > 0
  explicit ContactForce(double coupling) : coupling_(coupling) {}

  /// A newer model, at the tick at which it is first used.
  void update(const TissueModel& model, const Eigen::Vector3d& x, const Eigen::Vector3d& v) noexcept;
  /// Force of one tick, N, world. Real-time safe.
  Eigen::Vector3d evaluate(const Eigen::Vector3d& x, const Eigen::Vector3d& v, double dt) noexcept;
  /// What the model alone asks for, N: no coupling, no blend.
  Eigen::Vector3d trueForce(const Eigen::Vector3d& x, const Eigen::Vector3d& v) const noexcept;
  /// Most that the contact can give back, J: 1.5 F²/2K, exact for a spring that hardens with the cube.
  double storedEnergy() const noexcept;
  void reset() noexcept;
  const TissueModel& model() const noexcept { return model_; }
  /// p, m, world, for a hand at x that touches something.
  Eigen::Vector3d proxy(const Eigen::Vector3d& x, const Eigen::Vector3d& v) const noexcept;

 private:
  struct Found {
    Eigen::Vector3d d;      ///< m: p − x0, within the model's radius
    Eigen::Vector3d force;  ///< N, of the tissue at p
  };
  Found coupled(const TissueModel& m, const Eigen::Vector3d& x, const Eigen::Vector3d& v) const noexcept;
  Eigen::Vector3d unilateral(const TissueModel& m, Eigen::Vector3d force) const noexcept;

  double coupling_;
  TissueModel model_;
  Eigen::Vector3d residual_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
};

}  // namespace vest::haptics

#pragma once

#include <Eigen/Core>

#include "vest_tissue/scene/world_model.h"

namespace vest::scene {

struct Context;
struct ObjectScratch;

/// What an object does as tissue. Stages and verbs call it, once an object and batch and never for each
/// element, and do not ask which kind they act on. It keeps nothing: what evolves is in the State.
class Body {
 public:
  static constexpr int kLast = 2;
  virtual ~Body() = default;

  /// Order within a batch, 0 … kLast. What moves early answers implicitly to what moves later, and gives it
  /// its force.
  virtual int turn() const { return kLast; }
  /// Times a step (of the description's dt) that it takes forces; `batches` at least.
  virtual int stepsOf(const ObjectState& s) const { return s.batches; }
  /// Sub-steps for its present strain.
  virtual void renewBound(Context&, std::size_t /*object*/) const {}
  /// Forces that are held over a batch of h seconds: gravity, loads, its own slower elements.
  virtual void begin(Context&, std::size_t object, double h, int batch) const;
  virtual void advance(Context&, std::size_t object, int batch) const = 0;

  /// False: it follows forces at once, in equilibrium, and knows what gravity does to it.
  virtual bool hasInertia() const { return true; }
  /// Clips and slings take hold of it.
  virtual bool fastens() const { return true; }
  /// Cut, clipped or denatured it is no longer what it was built as.
  virtual void change(ObjectState&) const {}
  /// Before a step's batches: what its knots answer to held forces.
  virtual void soften(Context&, std::size_t /*object*/) const {}
  /// m/N: greatest answer of what has no inertia to forces of length 1, whatever knots these hold; else 0.
  virtual double softest(Context&, std::size_t /*object*/) const { return 0.0; }
  /// m/N: what knot a of it does by a force on knot b. Of knots in equilibrium, where
  /// ObjectScratch::answered.
  virtual Eigen::Matrix3d answer(const Context&, std::size_t /*object*/, std::uint32_t /*a*/,
                                 std::uint32_t /*b*/) const {
    return Eigen::Matrix3d::Zero();
  }
  /// A knot gains velocity, m/s.
  virtual void accelerate(ObjectState& s, std::uint32_t knot, const Eigen::Vector3d& gain) const;

  /// Tissue lies beneath its surface, which looks outward; else it is a wall, or strands.
  virtual bool filled() const { return false; }
  /// Its parts hang on tethers, which go with what a cut leaves without hold.
  virtual bool tethered() const { return true; }
  /// Divides what this step's sweeps (CutScratch) crossed; renews what holds on to it, and tells it.
  virtual void divide(Context&, std::size_t object) const = 0;
  /// Heat between its knots over `dt`, s.
  virtual void conduct(Context&, std::size_t object, double dt) const = 0;
  /// Denatured tissue is shorter and stiffer.
  virtual void denature(ObjectState&) const = 0;
  /// Of its volume at rest: what is left where it is pressed most, near marked knots.
  virtual double leastVolume(const ObjectConstants&, const ObjectState&,
                             const std::vector<std::uint16_t>& /*marked*/) const {
    return 1.0;
  }

  virtual double elasticEnergy(const ObjectConstants&, const ObjectState&) const = 0;  ///< J
  virtual void strain(const ObjectConstants&, const ObjectState&, float* per_knot) const = 0;
  virtual void stress(const ObjectConstants&, const ObjectState&, float* per_knot) const = 0;

  /// Room that steps use, for a State and its scratch.
  virtual void reserve(const ObjectConstants&, const ObjectState& start, ObjectState&) const { (void)start; }
  virtual void reserve(const ObjectConstants&, const ObjectState&, ObjectScratch&) const {}
};

/// Nothing that is done to it changes it.
class RigidBody : public Body {
 public:
  bool tethered() const override { return false; }
  void advance(Context&, std::size_t, int) const override {}
  void divide(Context&, std::size_t) const override {}
  void conduct(Context&, std::size_t, double) const override {}
  void denature(ObjectState&) const override {}
  double elasticEnergy(const ObjectConstants&, const ObjectState&) const override { return 0.0; }
  void strain(const ObjectConstants&, const ObjectState&, float*) const override {}
  void stress(const ObjectConstants&, const ObjectState&, float*) const override {}
};

/// Knots and links that take explicit sub-steps.
class NetBody : public Body {
 public:
  int stepsOf(const ObjectState& s) const override { return std::max(s.batches, s.sub_steps); }
  void renewBound(Context&, std::size_t object) const override;
  void begin(Context&, std::size_t object, double h, int batch) const override;
  void advance(Context&, std::size_t object, int batch) const override;
  void divide(Context&, std::size_t object) const override;  ///< verbs/cut.cpp
  void conduct(Context&, std::size_t object, double dt) const override;
  void denature(ObjectState&) const override;
  double elasticEnergy(const ObjectConstants&, const ObjectState&) const override;
  void strain(const ObjectConstants&, const ObjectState&, float* per_knot) const override;
  void stress(const ObjectConstants&, const ObjectState&, float* per_knot) const override;
};

/// A net too stiff for that: one solver::ImplicitNet step a batch.
class ImplicitNetBody : public NetBody {
 public:
  int stepsOf(const ObjectState& s) const override { return s.batches; }
  void renewBound(Context&, std::size_t) const override {}
  void begin(Context& c, std::size_t object, double h, int batch) const override {
    Body::begin(c, object, h, batch);  // its slower elements are part of the step
  }
  void advance(Context&, std::size_t object, int batch) const override;
  using Body::reserve;
  void reserve(const ObjectConstants&, const ObjectState&, ObjectScratch&) const override;
};

/// Finite elements: one implicit step a batch.
class ElementsBody : public Body {
 public:
  int turn() const override { return 1; }
  void advance(Context&, std::size_t object, int batch) const override;
  void accelerate(ObjectState& s, std::uint32_t knot, const Eigen::Vector3d& gain) const override {
    s.tissue.v[knot] += gain;
  }
  bool filled() const override { return true; }
  bool tethered() const override { return false; }
  void divide(Context&, std::size_t object) const override;  ///< fem_cut.cpp
  void conduct(Context&, std::size_t object, double dt) const override;
  void denature(ObjectState&) const override;
  double leastVolume(const ObjectConstants& k, const ObjectState& s,
                     const std::vector<std::uint16_t>& marked) const override {
    return fem::leastVolume(*k.fem, s.tissue, marked);
  }
  double elasticEnergy(const ObjectConstants& k, const ObjectState& s) const override {
    return fem::tissueEnergy(*k.fem, s.tissue);
  }
  void strain(const ObjectConstants& k, const ObjectState& s, float* per_knot) const override {
    fem::tissueStrain(*k.fem, s.tissue, per_knot);
  }
  void stress(const ObjectConstants& k, const ObjectState& s, float* per_knot) const override {
    fem::tissueStress(*k.fem, s.tissue, per_knot);
  }
  void reserve(const ObjectConstants& k, const ObjectState& start,
               ObjectState& s) const override;  ///< fem_cut.cpp
  void reserve(const ObjectConstants&, const ObjectState&, ObjectScratch&) const override;
};

/// Elastostatic elements. Parts that a cut frees have inertia.
class ElastostaticBody : public ElementsBody {
 public:
  int turn() const override { return 0; }
  bool hasInertia() const override { return false; }
  void change(ObjectState&) const override;
  void soften(Context&, std::size_t object) const override;
  double softest(Context&, std::size_t object) const override;
  Eigen::Matrix3d answer(const Context&, std::size_t object, std::uint32_t a, std::uint32_t b) const override;
  void accelerate(ObjectState& s, std::uint32_t knot, const Eigen::Vector3d& gain) const override {
    if (s.tissue.factored) s.tissue.v[knot] += gain;  // what is in equilibrium forgets it
  }
};

/// Elastostatic elements whose inside is condensed. What is done to it pushes and warms it, and changes
/// nothing of it.
class CondensedBody : public ElastostaticBody {
 public:
  bool fastens() const override { return false; }
  void change(ObjectState&) const override {}
  void divide(Context&, std::size_t) const override {}
  void conduct(Context&, std::size_t object, double dt) const override;
  void denature(ObjectState&) const override {}
};

/// 1/kg: how a knot counts for held forces that answers to them with `softness`, m/N, within steps of h, s.
constexpr double inverseMassOf(double softness, double h) {
  constexpr double kPatch = 8.0;  // knots that press an elastostatic object at a time (assumed)
  return kPatch * softness / (h * h);
}
/// Of elements: masses into the block, as inertia too; places and velocities into it; how the surface hangs
/// on the faces, at building.
void copyMasses(ObjectState& s, bool inertia);
void copyTissue(ObjectState& s);
void fillFemSurface(const fem::TissueModel& tissue, ObjectState& s);
/// A knot of elements in equilibrium, which has no inertia.
bool still(const ObjectState& s, const ObjectScratch& o, std::size_t knot);

extern const RigidBody kRigidBody;
extern const NetBody kNetBody;
extern const ImplicitNetBody kImplicitNetBody;
extern const ElementsBody kElementsBody;
extern const ElastostaticBody kElastostaticBody;
extern const CondensedBody kCondensedBody;

}  // namespace vest::scene

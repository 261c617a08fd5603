#include <algorithm>
#include <cmath>

#include "../scene/stages.h"
#include "vest_tissue/interaction/fasteners.h"

namespace vest::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using interaction::Clip;
using net::Block;

constexpr double kShare = 0.4;      ///< (omega·h)² of a joint, and of its damping what momentum there is
constexpr double kStrength = 20.0;  ///< N that a joint bears; assumed: titanium clips open at 5 to 20 N

/// What one part of a clip holds, as a rigid body.
struct Group {
  Vector3d centre = Vector3d::Zero(), velocity = Vector3d::Zero(), turn = Vector3d::Zero();
  Matrix3d rotation, inverse_inertia;
  double inverse_mass = 0.0;

  Group(const ObjectState& s, const Clip& clip) {
    const float* const mass = row(s, Block::kMass);
    double total = 0.0;
    for (int i = 0; i < clip.count; ++i) {
      const double m = mass[clip.knots[i]];
      total += m, centre += m * knotPosition(s, clip.knots[i]),
          velocity += m * knotVelocity(s, clip.knots[i]);
    }
    inverse_mass = 1.0 / total, centre *= inverse_mass, velocity *= inverse_mass;
    Matrix3d moment = Matrix3d::Zero(), inertia = Matrix3d::Zero();
    Vector3d spin = Vector3d::Zero();
    for (int i = 0; i < clip.count; ++i) {
      const double m = mass[clip.knots[i]];
      const Vector3d r = knotPosition(s, clip.knots[i]) - centre;
      moment += m * r * (clip.open[i] + clip.progress * (clip.closed[i] - clip.open[i])).transpose();
      inertia += m * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
      spin += m * r.cross(knotVelocity(s, clip.knots[i]));
    }
    rotation = interaction::nearestRotation(moment, clip.rotation);
    inertia.diagonal().array() += 1e-6 * inertia.trace() + 1e-24;  // of a group on one line
    inverse_inertia = inertia.inverse();
    turn = inverse_inertia * spin;
  }
  Vector3d velocityAt(const Vector3d& r) const { return velocity + turn.cross(r); }
  /// 1/kg, at most, of a place at r from the centre.
  double answer(const Vector3d& r) const {
    Matrix3d lever;
    lever << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return inverse_mass + (lever * inverse_inertia * lever.transpose()).trace();
  }
  /// A force at r, on all knots as on a rigid body: their sum and torque are the force's.
  void push(ObjectState& s, const Clip& clip, const Vector3d& r, const Vector3d& force) const {
    const Vector3d spin_up = inverse_inertia * r.cross(force);
    for (int i = 0; i < clip.count; ++i) {
      const std::uint32_t k = clip.knots[i];
      const double m = row(s, Block::kMass)[k];
      addHeld(s, k, m * (inverse_mass * force + spin_up.cross(knotPosition(s, k) - centre)));
    }
  }
};

}  // namespace

void joinClips(Context& c, int batch, int batches) {
  auto& clips = c.state.fasteners.clips;
  const auto every = [&](const Clip& clip) {
    return batches / (c.state.objects[clip.object].batches * c.stretch);
  };
  for (std::size_t n = 0; n < clips.size(); ++n) {
    const Clip& part = clips[n];
    if (!part.alive || !part.joined) continue;
    const auto first = std::find_if(clips.begin(), clips.end(),
                                    [&](const Clip& o) { return o.alive && o.joined && o.id == part.id; });
    const bool due0 = batch % every(*first) == 0, due1 = batch % every(part) == 0;
    if (&*first == &part || (!due0 && !due1)) continue;
    ObjectState &s0 = c.state.objects[first->object], &s1 = c.state.objects[part.object];
    const Group a(s0, *first), b(s1, part);
    const double h = c.dt / (std::min(s0.batches, s1.batches) * c.stretch);
    for (std::size_t j = 0; j < part.joint.size(); ++j) {
      const Vector3d r0 = a.rotation * first->joint[j], r1 = b.rotation * part.joint[j];
      Vector3d& force = c.scratch.clip_force[n][j];
      if (due0 && due1) {
        const Vector3d rate = b.velocityAt(r1) - a.velocityAt(r0);
        const Vector3d off = b.centre + r1 - a.centre - r0 + 0.5 * h * rate;
        const double inverse = static_cast<double>(part.joint.size()) * (a.answer(r0) + b.answer(r1));
        const double damping = kShare / (h * inverse);
        force = kShare / (h * h * inverse) * off + damping * rate;
        const double most = std::sqrt(force.squaredNorm());
        if (most > kStrength) force *= kStrength / most;
        if (c.account) c.state.energy.dissipated += damping * rate.squaredNorm() * h;
      }
      // Both at one place: no torque is left.
      const Vector3d at = 0.5 * (a.centre + r0 + b.centre + r1);
      if (due0) a.push(s0, *first, at - a.centre, force);
      if (due1) b.push(s1, part, at - b.centre, -force);
    }
  }
}

}  // namespace vest::scene

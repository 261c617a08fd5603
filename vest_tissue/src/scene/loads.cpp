#include <algorithm>
#include <cmath>

#include "stages.h"

namespace vest::scene {

using net::Block;

namespace {

float bounded(float force) {
  return std::isfinite(force) ? std::clamp(force, -kGreatestLoad, kGreatestLoad) : 0.0f;
}
float boundedDamping(float damping) {
  return std::isfinite(damping) ? std::clamp(damping, 0.0f, kGreatestLoadDamping) : 0.0f;
}

/// The lift that follows the knot. What has no inertia would follow it within one step: its own is held with
/// the rest.
void takeLift(const KnotLoad& l, float z, HeldLoad::Of& told) {
  if (!(std::fabs(l.stiffness) > 0.0f) || !std::isfinite(l.depth)) return;
  const float stiffness = std::clamp(l.stiffness, -kGreatestLoadStiffness, kGreatestLoadStiffness);
  const float level = std::clamp(z + l.depth, -kGreatestLoadLevel, kGreatestLoadLevel);
  told[HeldLoad::kZ] = bounded(told[HeldLoad::kZ] - stiffness * std::max(0.0f, level - z));
  told[HeldLoad::kStiffness] = stiffness, told[HeldLoad::kLevel] = level;
}

}  // namespace

void takeLoads(Context& c) {
  const StepInput& in = c.input;
  if (in.load_over > 0.0) {  // nothing that is no number
    const double over = std::min(in.load_over, kLongestLoad);
    for (ObjectState& s : c.state.objects) {
      if (!s.load.any) continue;
      std::fill(s.load.told.begin(), s.load.told.end(), HeldLoad::Of{});
      s.load.left = over;
    }
    for (const KnotLoad& l : in.loads) {
      if (l.object >= c.state.objects.size() || !c.model.objects[l.object].deforms) continue;
      ObjectState& s = c.state.objects[l.object];
      if (l.knot >= s.block.knots()) continue;
      if (!s.load.any) std::copy_n(row(s, Block::kDecay), s.block.knots(), s.load.own.begin());
      s.load.any = true;
      s.load.left = over;
      HeldLoad::Of& told = s.load.told[l.knot];
      for (std::size_t axis = 0; axis < 3; ++axis) told[axis] = bounded(told[axis] + bounded(l.force[axis]));
      told[3] = boundedDamping(told[3] + boundedDamping(l.damping));
      if (c.body(l.object).hasInertia()) takeLift(l, row(s, Block::Z)[l.knot], told);
    }
    for (ObjectState& s : c.state.objects) {  // a lift that comes or goes does so at its own level
      if (!s.load.any) continue;
      for (std::size_t k = 0; k < s.block.knots(); ++k) {
        HeldLoad::Of &now = s.load.now[k], &told = s.load.told[k];
        if (now[HeldLoad::kStiffness] == 0.0f) now[HeldLoad::kLevel] = told[HeldLoad::kLevel];
        if (told[HeldLoad::kStiffness] == 0.0f) told[HeldLoad::kLevel] = now[HeldLoad::kLevel];
      }
    }
  }
  for (ObjectState& s : c.state.objects) {
    if (!s.load.any) continue;
    s.load.go(c.dt, s.block.knots());
    float* const decay = s.block.row(Block::kDecay);
    const float* const inverse = s.block.row(Block::kInverseMass);
    for (std::size_t k = 0; k < s.block.knots(); ++k)
      decay[k] = s.load.own[k] + s.load.now[k][3] * inverse[k];
  }
}

void accountLoads(Context& c) {
  for (std::size_t i = 0; i < c.state.objects.size(); ++i) {
    const ObjectState& s = c.state.objects[i];
    if (!s.load.any) continue;
    const std::size_t stride = s.block.motionFloats() / 6;
    double work = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* const x = s.block.motion() + axis * stride;
      const float* const before = c.scratch.objects[i].backup.data() + axis * stride;
      for (std::size_t k = 0; k < c.scratch.objects[i].knots_before; ++k)
        work += static_cast<double>(s.load.now[k][axis]) * (static_cast<double>(x[k]) - before[k]);
    }
    const float *z = row(s, Block::Z),
                *z_before = c.scratch.objects[i].backup.data() + (z - s.block.motion());
    for (std::size_t k = 0; k < c.scratch.objects[i].knots_before; ++k)  // ∫ K u dz, u the depth
      work += 0.5 * (static_cast<double>(s.load.lift(k, z[k])) + s.load.lift(k, z_before[k])) *
              (static_cast<double>(z[k]) - z_before[k]);
    c.state.energy.work += work;
  }
}

}  // namespace vest::scene

#include <algorithm>
#include <cmath>

#include "stages.h"

namespace vest::scene {
namespace {

float bounded(float force) {
  return std::isfinite(force) ? std::clamp(force, -kGreatestLoad, kGreatestLoad) : 0.0f;
}

}  // namespace

void takeLoads(Context& c) {
  const StepInput& in = c.input;
  if (in.load_over > 0.0) {  // nothing that is no number
    const double over = std::min(in.load_over, kLongestLoad);
    for (ObjectState& s : c.state.objects) {
      if (!s.load.any) continue;
      std::fill(s.load.told.begin(), s.load.told.end(), 0.0f);
      s.load.left = over;
    }
    for (const KnotLoad& l : in.loads) {
      if (l.object >= c.state.objects.size() || !c.model.objects[l.object].net) continue;
      ObjectState& s = c.state.objects[l.object];
      if (l.knot >= s.block.knots()) continue;
      s.load.any = true;
      s.load.left = over;
      for (std::size_t axis = 0; axis < 3; ++axis)
        s.load.told[3 * l.knot + axis] = bounded(s.load.told[3 * l.knot + axis] + bounded(l.force[axis]));
    }
  }
  for (ObjectState& s : c.state.objects) s.load.go(c.dt, s.block.knots());
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
        work += static_cast<double>(s.load.now[3 * k + axis]) * (static_cast<double>(x[k]) - before[k]);
    }
    c.state.energy.work += work;
  }
}

}  // namespace vest::scene

#include "connections.h"
#include "stages.h"
#include "world_impl.h"

namespace vest::scene {

using Eigen::Vector3d;
using net::Block;

Energy World::energy() const {
  const WorldState& state = impl_->state;
  Energy e;
  e.work = state.energy.work;
  e.dissipated = state.energy.dissipated;
  for (const std::size_t i : impl_->model->bodies) {
    const ObjectConstants& constants = impl_->model->objects[i];
    const ObjectState& s = state.objects[i];
    const float* const mass = row(s, Block::kMass);
    for (std::uint32_t k = 0; k < s.block.knots(); ++k) {
      if (s.fixed[k]) continue;
      const Vector3d v = knotVelocity(s, k);
      e.kinetic += 0.5 * mass[k] * v.squaredNorm();
      e.potential -= mass[k] * state.gravity.dot(knotPosition(s, k));
    }
    e.elastic += constants.body->elasticEnergy(constants, s);
  }
  for (std::size_t n = 0; n < state.connections.size(); ++n) {
    const ConnectionState& c = state.connections[n];
    if (!c.alive) continue;
    const Vector3d off = stretchOf(state, c, impl_->model->connections[n]);
    e.elastic += 0.5 * impl_->model->description.connections[n].stiffness * off.squaredNorm();
  }
  // Springs between tools and tissue: held knots, then the contacts of the last step.
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto& grasp = state.grasps[t];
    if (!grasp.active) continue;
    const auto& pose = state.proxies[t].pose;
    for (int i = 0; i < grasp.count; ++i) {
      const auto& g = grasp.anchors[i];
      const Vector3d off =
          pose.tip + pose.orientation * g.local - knotPosition(state.objects[g.object], g.knot);
      e.elastic += 0.5 * g.stiffness * off.squaredNorm();
    }
  }
  e.elastic += suspensionEnergy(state);
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const ObjectState& s = state.objects[i];
    for (const auto& c : impl_->scratch.objects[i].contacts) {
      const double gap = gapOf(s, c);
      if (gap < 0.0) e.elastic += 0.5 * c.stiffness * gap * gap;
    }
    for (const auto& c : impl_->scratch.objects[i].planes) {
      const Vector3d n(c.normal[0], c.normal[1], c.normal[2]);
      const double gap = n.dot(knotPosition(s, c.knot)) - c.offset;
      if (gap < 0.0) e.elastic += 0.5 * c.stiffness * gap * gap;
    }
  }
  for (const OrganContact& r : impl_->scratch.organ_contacts) {
    Vector3d off, rate;
    apart(state, r, off, rate);
    const double gap = r.normal.cast<double>().dot(off) - r.reach;
    if (gap < 0.0) e.elastic += 0.5 * r.stiffness * gap * gap;
  }
  return e;
}

}  // namespace vest::scene

#pragma once

#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/solver/net_energy.h"

namespace vest::scene {

/// An object's links for the step bound.
inline solver::BoundLinks boundLinks(const ObjectState& s) {
  solver::BoundLinks b;
  b.block = &s.block;
  b.count = s.links.size();
  b.stride = sizeof(NetLink);
  if (!s.links.empty()) b.first = &s.links[0].values, b.by_law = &s.links[0].by_law;
  b.law = s.law_links.law();
  return b;
}

/// The same for the implicit step.
inline solver::NetView netView(const ObjectState& s) {
  return {boundLinks(s), &s.elements};
}

}  // namespace vest::scene

#pragma once

#include "vest_tissue/scene/world_model.h"

namespace vest::scene {

/// Kernel arrays of an object with its law as it is now.
inline net::KernelArrays objectArrays(const ObjectState& s, const ObjectConstants& c) {
  net::KernelArrays a = const_cast<net::Block&>(s.block).arrays();
  const float limit = s.limit_strain;
  a.a2 = static_cast<float>(c.law.a2);
  a.a3 = static_cast<float>(c.law.a3);
  a.a4 = static_cast<float>(c.law.a4);
  a.max_strain = limit;
  a.excess_slope = limit * (2.0f * a.a2 + limit * (3.0f * a.a3 + limit * 4.0f * a.a4));
  return a;
}

}  // namespace vest::scene

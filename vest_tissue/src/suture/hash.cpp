#include <memory>
#include <stdexcept>

#include <xxhash.h>

#include "vest_tissue/suture/rod.h"

namespace vest::suture {

std::uint64_t stateHash(const State& state) {
  struct Free {
    void operator()(XXH64_state_t* hash) const { XXH64_freeState(hash); }
  };
  const std::unique_ptr<XXH64_state_t, Free> hash(XXH64_createState());
  XXH64_reset(hash.get(), 0);
  const auto add = [&](const auto* data, std::size_t count) {
    XXH64_update(hash.get(), data, count * sizeof *data);
  };
  add(&state.time, 1);
  add(state.position.data(), state.position.size());
  add(state.velocity.data(), state.velocity.size());
  for (const auto& q : state.frame) add(q.coeffs().data(), 4);
  add(state.spin.data(), state.spin.size());
  add(state.natural_curvature.data(), state.natural_curvature.size());
  for (const auto& q : state.offset) add(q.coeffs().data(), 4);
  add(state.severed.data(), state.severed.size());
  for (Index k = 0; k < state.contact_count; ++k) {
    const LiveContact& c = state.contacts[k];
    add(&c.a, 1), add(&c.b, 1), add(c.normal.data(), 3), add(c.force.data(), 3);
  }
  return XXH64_digest(hash.get());
}

}  // namespace vest::suture

#include <algorithm>

#include "scratch.h"

namespace vest::fluid {

void findPlanes(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  constexpr std::size_t kMostTogether = 16;  // particles (tuned)
  const std::size_t n = state.particles.count;
  std::fill_n(s.plane_count.begin(), n, std::uint8_t{0});
  if (n == 0 || inputs.surface_count == 0) return;
  const float reach = 0.75f * model.h, skin = static_cast<float>(model.parameters.spacing);
  // Particles of one cell look together; they are sorted already. Groups do not depend on the threads.
  Extent particles;
  s.group_count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    Extent way;
    const float start[3] = {s.px[i], s.py[i], s.pz[i]};
    way.add(start), way.add(s.place[i].a);
    particles.add(way.low), particles.add(way.high);
    if (i > 0 && s.cell[s.order[i]] == s.cell[s.order[i - 1]]) {
      ParticleGroup& group = s.groups[s.group_count - 1];
      Extent both = group.ways;
      both.add(way.low), both.add(way.high);
      const float size =
          std::max({both.high[0] - both.low[0], both.high[1] - both.low[1], both.high[2] - both.low[2]});
      // The cells of the modular grid come again: what shares one from afar goes alone, as what flies fast.
      if (group.count < kMostTogether && size < 4 * reach) {
        group.ways = both;
        ++group.count;
        continue;
      }
    }
    ParticleGroup& group = s.groups[s.group_count++];
    group.first = static_cast<std::uint32_t>(i), group.count = 1, group.ways = way;
  }
  nearBlocks(inputs, particles, s, reach);
  s.kernels->meet(s);
  placeTriangles(model, inputs, state, s, reach);
  const PlaneSearch f{reach, skin, static_cast<float>(1.0 / inputs.dt)};
  parts(s.group_count, s.threads,
        [&](std::size_t from, std::size_t to) { s.kernels->planes(f, s, from, to); });
}

}  // namespace vest::fluid

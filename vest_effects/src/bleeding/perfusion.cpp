#include "vest_effects/bleeding/perfusion.h"

#include <algorithm>

namespace vest::bleeding {

PerfusionState initialPerfusion(std::size_t knots) {
  PerfusionState s;
  s.reach.assign(knots, 1.0f);
  s.saturation.assign(knots, static_cast<float>(kAtRest));
  s.dilation.assign(knots, 0.0f);
  return s;
}

void stepPerfusion(const PerfusionInputs& in, double dt, PerfusionState& state) {
  constexpr double kExchange = kConsumption / (kArterial - kAtRest);  // k, 1/s
  const double blanching = dt / (dt + kBlanchTime), dilating = dt / (dt + kDilationTime);
  for (std::size_t object = 0; object < in.objects; ++object) {
    const double arterial = in.arterial ? in.arterial[object] : 1.0,
                 drained = in.drained ? in.drained[object] : 1.0;
    for (std::uint32_t i = in.first[object]; i < in.first[object + 1]; ++i) {
      const double fed = in.fed && !in.fed[i] ? 0.0 : 1.0;
      const double reach = state.reach[i] + blanching * (fed - state.reach[i]), d = state.dilation[i];
      // Nobody has more veins than it needs at rest: open ones carry off whatever comes.
      const double q = (drained < 1 ? std::min(arterial * reach, drained) : arterial * reach) *
                       (1 + (kHyperaemia - 1) * d);
      const double s = state.saturation[i], use = kConsumption * std::min(1.0, 10 * s);
      // Implicit in the exchange: no overshoot for any step.
      const double next = (s + dt * (kExchange * q * kArterial - use)) / (1 + dt * kExchange * q);
      const double goal = std::clamp((kAtRest - next) / kHypoxia, 0.0, 1.0);
      state.reach[i] = static_cast<float>(reach);
      state.saturation[i] = static_cast<float>(std::clamp(next, 0.0, 1.0));
      state.dilation[i] = static_cast<float>(d + dilating * (goal - d));
    }
  }
}

}  // namespace vest::bleeding

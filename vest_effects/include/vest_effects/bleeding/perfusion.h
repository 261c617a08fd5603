#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

/// What becomes of tissue that loses its blood supply: it blanches, turns blue, and flushes when the blood
/// comes back. Per knot, SI, no ROS, no scene.
///
///     reach       r' = (fed − r)/kBlanchTime                      fed: it hangs on what brings blood
///     flow        q  = min(arterial · r, drained) (1 + (kHyperaemia − 1) d)    over that at rest
///     saturation  S' = k q (kArterial − S) − M min(1, S/0.1)      k so that S stands at kAtRest for q = 1
///     dilation    d' = (clamp((kAtRest − S)/kHypoxia, 0, 1) − d)/kDilationTime
///
/// M and the speed of recovery are those of muscle of the hand whose arteries a cuff closed for three minutes
/// (Crit. Care 2009, 13(Suppl 1), doi:10.1186/cc7404, 25 subjects): −11.2 %/min, +213 %/min, 15 % above rest,
/// back at rest after 2.4 min. The same for organs: assumed; bowel uses more.
namespace vest::bleeding {

/// s: in which blood leaves what is cut off, as haemodynamics::kPerfusionTime.
constexpr double kBlanchTime = 2.0;
constexpr double kArterial = 0.98;           ///< saturation of arterial blood (Guyton and Hall, chapter 41)
constexpr double kAtRest = 0.80;             ///< of what near-infrared light sees at rest (PubMed 22697622)
constexpr double kConsumption = 0.112 / 60;  ///< M, 1/s, of the same
/// Flow after a closure over that at rest: four to seven times (Guyton and Hall, chapter 17).
constexpr double kHyperaemia = 7.0;
constexpr double kHypoxia = 0.1;        ///< of saturation below rest: dilation is whole (assumed)
constexpr double kDilationTime = 30.0;  ///< s: so that it has recovered as in the same source (fitted)

/// Everything that evolves; per knot, room for copies included.
struct PerfusionState {
  std::vector<float> reach;       ///< 0 … 1: share of its supply that comes here
  std::vector<float> saturation;  ///< 0 … 1: of the haemoglobin in its small vessels
  std::vector<float> dilation;    ///< 0 … 1: of its arterioles
};

struct PerfusionInputs {
  const std::uint32_t* first = nullptr;  ///< per object: its first knot; one more at the end
  std::size_t objects = 0;
  const double* arterial = nullptr;   ///< per object: what its vessels bring over that at rest; null: 1
  const double* drained = nullptr;    ///< per object: how far its veins are open, 0 … 1; null: 1
  const std::uint8_t* fed = nullptr;  ///< per knot: 0 is cut off, or tied off
};

PerfusionState initialPerfusion(std::size_t knots);
/// Allocates nothing. dt in s, up to 1 s.
void stepPerfusion(const PerfusionInputs& inputs, double dt, PerfusionState& state);

}  // namespace vest::bleeding

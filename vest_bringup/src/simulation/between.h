#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <type_traits>

#include "vest_effects/bleeding/swab.h"
#include "vest_effects/fluid/step.h"
#include "vest_effects/lens/lens.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::simulation {

constexpr double kBore = 2e-7;  ///< m³ of clot that closes it: 20 mm of a bore of 3.5 mm (assumed)

/// What evolves here beside the cores: sums between their steps, and what edits changed.
struct Between {
  std::array<fluid::Source, fluid::kMostSources> source{};  ///< flow is volume, m³, since the last fluid step
  std::array<double, fluid::kMostSources> moment{};         ///< m³·blood fraction
  std::array<double, tools::kInstrumentCount> energy{};     ///< J since the last smoke step
  std::array<std::array<double, 3>, tools::kInstrumentCount> energy_place{};
  std::array<std::array<double, 3>, tools::kInstrumentCount> tip{};  ///< m, at the last fluid step
  std::array<std::uint8_t, tools::kInstrumentCount> has_tip{};
  std::array<lens::Hit, lens::kMostHits> hits{};
  int hit_count = 0;
  std::uint8_t wiped = 0, warming = 0, rinse = 0;
  float wiped_on_blood = 0;
  std::array<std::array<double, 2>, tools::kInstrumentCount> valve{};  ///< 0 shut … 1 open: water, suction
  double irrigation_flow = 0, suction_flow = 0, bag_pressure = 0, yield = 0;
  double sucked = 0;       ///< m³ of liquid, until the last smoke step
  double humidity = 0.95;  ///< relative, of the cavity's gas at the last lens step
  std::array<double, tools::kInstrumentCount> clogged{};  ///< m³ of clot in each sucker's bore
  std::array<bleeding::Swab, tools::kInstrumentCount> swab{};
};
static_assert(std::is_trivially_copyable_v<Between>);

/// Whether a step can have left it so.
inline bool sane(const Between& b) {
  const auto bore = [](double v) { return v >= 0 && v <= kBore; };
  const auto swab = [](const bleeding::Swab& w) {
    return w.blood >= 0 && w.volume >= 0 && w.volume <= 2 * bleeding::kSwabCapacity;
  };
  return std::all_of(b.clogged.begin(), b.clogged.end(), bore) &&
         std::all_of(b.swab.begin(), b.swab.end(), swab) && b.wiped_on_blood >= 0 && b.wiped_on_blood <= 1 &&
         b.hit_count >= 0 && b.hit_count <= lens::kMostHits;
}

}  // namespace vest::simulation

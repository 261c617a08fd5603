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

/// Whether a step can have left it so. Also false for what is no number.
inline bool sane(const Between& b) {
  const auto within = [](double v, double least, double most) { return v >= least && v <= most; };
  const auto near = [&](const std::array<double, 3>& v) {
    return std::all_of(v.begin(), v.end(), [&](double x) { return within(x, -1e5, 1e5); });
  };
  const auto all = [](const auto& of, auto&& good) { return std::all_of(of.begin(), of.end(), good); };
  const auto switched = [](std::uint8_t v) { return v <= 1; };
  return all(b.source,
             [&](const fluid::Source& s) {
               return within(s.flow, 0, 1) && within(s.area, 0, 1) && near(s.position) && near(s.direction) &&
                      near(s.velocity);
             }) &&
         all(b.moment, [&](double v) { return within(v, 0, 1); }) &&
         all(b.energy, [&](double v) { return within(v, 0, 1e9); }) && all(b.energy_place, near) &&
         all(b.tip, near) && all(b.has_tip, switched) && b.hit_count >= 0 && b.hit_count <= lens::kMostHits &&
         all(b.hits,
             [&](const lens::Hit& h) {
               return within(h.u, -1e5, 1e5) && within(h.v, -1e5, 1e5) && within(h.volume, 0, 1e-3) &&
                      within(h.blood, 0, 1);
             }) &&
         switched(b.wiped) && switched(b.warming) && switched(b.rinse) && within(b.wiped_on_blood, 0, 1) &&
         all(b.valve, [&](const auto& v) { return within(v[0], 0, 1) && within(v[1], 0, 1); }) &&
         within(b.irrigation_flow, 0, 5e-4) && within(b.suction_flow, 0, 5e-4) &&
         within(b.bag_pressure, 0, 6e4) && within(b.yield, 0, 1e-4) && within(b.sucked, 0, 1e5) &&
         within(b.humidity, 0, 1) && all(b.clogged, [&](double v) { return within(v, 0, kBore); }) &&
         all(b.swab, [&](const bleeding::Swab& w) {
           return within(w.volume, 0, 2 * bleeding::kSwabCapacity) &&
                  within(w.blood, 0, 4 * bleeding::kSwabCapacity);
         });
}

}  // namespace vest::simulation

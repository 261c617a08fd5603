#include "vest_effects/lens/lens.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "vest_effects/state_bytes.h"
#include "vest_effects/vapour.h"
#include "vest_tissue/solver/random.h"

namespace vest::lens {
namespace {

constexpr double kVapour = 461.5;         ///< J/(kg K): gas constant of water vapour
constexpr double kLatent = 2.43e6;        ///< J/kg at about 30 °C
constexpr double kAirHeat = 1.15 * 1005;  ///< J/(m³K) of air at 35 °C; CO2 has 1.5 times that (neglected)
constexpr double kLewis = 0.897;          ///< Le^⅔ for Le = 0.85

double vapourDensity(double kelvin, double humidity) {
  return humidity * effects::saturationPressure(kelvin) / (kVapour * kelvin);
}

void soil(const Inputs& in, const Hit& hit, std::uint64_t number, State& s) {
  // A drop spreads to about three times its diameter on wet glass (assumed), and never is quite round.
  const double radius =
      1.5 * effects::power(1.9098593 * std::max(0.0, static_cast<double>(hit.volume)), 1.0 / 3.0);
  const double reach = std::max(0.06, radius / std::max(1e-4, in.lens_radius));
  const double opacity = 0.25 + 0.6 * static_cast<double>(hit.blood);  // water blurs, blood covers (assumed)
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) {
      const double x = (c + 0.5) * 2 / kColumns - 1 - static_cast<double>(hit.u),
                   y = (r + 0.5) * 2 / kRows - 1 - static_cast<double>(hit.v);
      const double wobble =
          0.75 + 0.5 * solver::randomUniform(in.seed, number, static_cast<std::uint64_t>(8 * r + c / 4));
      const double t = 1 - (x * x + y * y) / (reach * reach * wobble);
      if (t <= 0) continue;
      const auto i = static_cast<std::size_t>(r * kColumns + c);
      const auto add = static_cast<float>(std::min(1.0, 1.5 * t) * opacity) * (1 - s.soiling[i]);
      const float sum = s.soiling[i] + add;
      if (sum > 0) s.blood[i] = (s.blood[i] * s.soiling[i] + hit.blood * add) / sum;
      s.soiling[i] = sum;
    }
  }
}

/// A drop begins to run; where all run already the smallest is forgotten, as what is left of it sticks.
void start(const Run& run, State& s) {
  auto& to = *std::min_element(s.runs.begin(), s.runs.end(),
                               [](const Run& a, const Run& b) { return a.mass < b.mass; });
  if (run.mass > to.mass) to = run;
}

/// f(cell) for each within `reach` of a place, in the lens' radii.
template <class F>
void eachNear(double u, double v, double reach, F&& f) {
  const auto from = [&](double at, int n) { return std::max(0, static_cast<int>((at - reach + 1) * n / 2)); };
  const auto to = [&](double at, int n) {
    return std::min(n - 1, static_cast<int>((at + reach + 1) * n / 2));
  };
  for (int r = from(v, kRows); r <= to(v, kRows); ++r)
    for (int c = from(u, kColumns); c <= to(u, kColumns); ++c) {
      const double x = (c + 0.5) * 2 / kColumns - 1 - u, y = (r + 0.5) * 2 / kRows - 1 - v;
      if (x * x + y * y <= reach * reach) f(static_cast<std::size_t>(r * kColumns + c));
    }
}

void stepRuns(const Parameters& p, const Inputs& in, State& s) {
  const double cell = 4 * in.lens_radius * in.lens_radius / (kColumns * kRows);  // m²
  for (std::size_t i = 0; i < s.water.size(); ++i) {
    if (!(static_cast<double>(s.water[i]) > p.drip)) continue;
    const int c = static_cast<int>(i) % kColumns, r = static_cast<int>(i) / kColumns;
    start({static_cast<float>((c + 0.5) * 2 / kColumns - 1), static_cast<float>((r + 0.5) * 2 / kRows - 1),
           static_cast<float>(static_cast<double>(s.water[i]) * cell), 0},
          s);
    s.water[i] = 0;
  }
  for (std::size_t k = 0; k < s.runs.size(); ++k) {
    Run& run = s.runs[k];
    if (!(run.mass > 0)) continue;
    // It wanders, and blood is slower than water by their viscosities' ratio or so (assumed).
    const double speed = p.run_speed / in.lens_radius * (1 - 0.7 * static_cast<double>(run.blood)) * in.dt;
    const double aside = solver::randomUniform(in.seed, s.step, 77 + k) - 0.5;
    run.u += static_cast<float>(speed * (in.down[0] + 0.6 * aside * in.down[1]));
    run.v += static_cast<float>(speed * (in.down[1] - 0.6 * aside * in.down[0]));
    if (!(std::fabs(run.u) < 1.1f && std::fabs(run.v) < 1.1f)) {
      run = {};
      continue;
    }
    const double radius =
        0.62 * effects::power(static_cast<double>(run.mass) / 1000, 1.0 / 3.0);  // m, a ball's
    const double reach = std::max(0.05, 1.2 * radius / in.lens_radius);
    double taken = 0;
    eachNear(static_cast<double>(run.u), static_cast<double>(run.v), reach, [&](std::size_t i) {
      taken += 0.9 * static_cast<double>(s.water[i]) * cell;
      s.water[i] *= 0.1f;
      const float add = (0.02f + 0.10f * run.blood) * (1 - s.soiling[i]), sum = s.soiling[i] + add;
      s.blood[i] = (s.blood[i] * s.soiling[i] + run.blood * add) / sum;
      s.soiling[i] = sum;
    });
    // A film of 20 µm as wide as the drop stays behind (assumed).
    const double left = 1000 * 2e-5 * 2 * radius * p.run_speed * in.dt;
    const double mass = static_cast<double>(run.mass) + taken - left;
    run.blood *= static_cast<float>(static_cast<double>(run.mass) / (static_cast<double>(run.mass) + taken));
    run.mass = mass > 1000 * 0.3 * static_cast<double>(kSticks) ? static_cast<float>(mass) : 0.0f;
  }
}

}  // namespace

double fog(const Parameters& p, const State& s) {
  return s.condensate / (s.condensate + p.blind);
}

double fogAt(const Parameters& p, const State& s, std::size_t cell) {
  const auto water = static_cast<double>(s.water[cell]);
  return water / (water + p.blind);
}

void check(const Parameters& p) {
  const auto within = [](const char* field, double v, double low, double high, const char* unit) {
    if (v >= low && v <= high) return;
    throw std::invalid_argument(std::string("lens: ") + field + ": " + std::to_string(v) + " (allowed: " +
                                std::to_string(low) + " to " + std::to_string(high) + unit + ")");
  };
  within("outside_temperature", p.outside_temperature, 250, 330, " K");
  within("start_temperature", p.start_temperature, 250, 350, " K");
  within("heat_capacity", p.heat_capacity, 100, 1e6, " J/(m2 K)");
  within("heat_transfer", p.heat_transfer, 0.1, 1000, " W/(m2 K)");
  within("illumination", p.illumination, 0, 1e4, " W/m2");
  within("warming", p.warming, 0, 1e5, " W/m2");
  within("blind", p.blind, 1e-5, 1, " kg/m2");
  within("drip", p.drip, 1e-4, 10, " kg/m2");
  within("run_speed", p.run_speed, 0, 1, " m/s");
  within("smoke_deposition", p.smoke_deposition, 0, 1, " m/s");
  within("smoke_opaque", p.smoke_opaque, 1e-9, 1, " kg/m2");
  within("rinse_time", p.rinse_time, 0.01, 1e6, " s");
  within("wipe_time", p.wipe_time, 0.01, 1e6, " s");
}

State initialState(const Parameters& p) {
  State s;
  s.temperature = p.start_temperature;
  return s;
}

Status step(const Parameters& p, const Inputs& in, State& s) {
  if (!(in.dt >= 1e-4 && in.dt <= 0.1) || !(in.smoke >= 0 && in.smoke < 10) || in.hit_count < 0 ||
      in.hit_count > kMostHits || !(in.wiped_on_blood >= 0 && in.wiped_on_blood <= 1) ||
      !(in.lens_radius > 1e-5 && in.lens_radius < 0.1) || !(in.temperature >= 250 && in.temperature <= 340) ||
      !(in.humidity >= 0 && in.humidity <= 1) || !(std::fabs(in.down[0]) <= 1) ||
      !(std::fabs(in.down[1]) <= 1))
    return Status::BadInput;
  for (int k = 0; k < in.hit_count; ++k) {
    const Hit& h = in.hits[k];
    if (!std::isfinite(h.u) || !std::isfinite(h.v) || !(h.volume >= 0 && h.volume < 1e-3f) ||
        !(h.blood >= 0 && h.blood <= 1))
      return Status::BadInput;
  }
  // Vapour: rho_v far away against rho_v saturated at the lens. Outside, the theatre's air is at 50 %.
  const double gas = in.outside ? p.outside_temperature : in.temperature,
               humidity = in.outside ? 0.5 : in.humidity;
  const double transfer = p.heat_transfer / (kAirHeat * kLewis);  // m/s
  double flux = transfer * (vapourDensity(gas, humidity) - vapourDensity(s.temperature, 1.0));
  if (flux < 0) flux = std::max(flux, -s.condensate / in.dt);  // no more dries than there is
  // Drops begin at scratches and dust: each place has its own share, the same for a lens (assumed).
  for (std::size_t i = 0; i < s.water.size(); ++i) {
    const double share = flux > 0 ? 0.75 + 0.5 * solver::randomUniform(in.seed, 991, i) : 1.0;
    s.water[i] = static_cast<float>(std::max(0.0, static_cast<double>(s.water[i]) + share * flux * in.dt));
  }
  // Heat: gas, light, warming, condensation. Outside it is dipped into water of 45 °C, as in theatres, and
  // takes that temperature within seconds (assumed).
  const double power = p.illumination + (in.warmed ? p.warming : 0.0) + flux * kLatent;
  const double rate = in.dt / p.heat_capacity;
  s.temperature = (s.temperature + rate * (p.heat_transfer * gas + power)) / (1 + rate * p.heat_transfer);
  if (in.outside) s.temperature += in.dt / (in.dt + 1.2) * (318.15 - s.temperature);
  s.temperature = std::min(s.temperature, 318.15);  // a warmer stops at 45 °C: hotter burns tissue

  const auto wash = [&](double time) {
    const auto keep = static_cast<float>(1.0 / (1.0 + in.dt / time));
    for (float& x : s.soiling) x *= keep;
    for (float& x : s.water) x *= keep;
    for (Run& run : s.runs) run.mass *= keep;
  };
  for (int k = 0; k < in.hit_count; ++k) {
    const Hit& hit = in.hits[static_cast<std::size_t>(k)];
    if (hit.volume > kSticks) start({hit.u, hit.v, 1000 * hit.volume, hit.blood}, s);
    soil(in, in.hits[k], s.step * static_cast<std::uint64_t>(kMostHits) + static_cast<std::uint64_t>(k), s);
  }
  stepRuns(p, in, s);
  const auto soot = static_cast<float>(in.smoke * p.smoke_deposition * in.dt / p.smoke_opaque);
  if (soot > 0) {
    for (std::size_t i = 0; i < s.soiling.size(); ++i) {
      const float add = soot * (1 - s.soiling[i]), sum = s.soiling[i] + add;
      if (sum > 0) s.blood[i] *= s.soiling[i] / sum;
      s.soiling[i] = std::min(1.0f, sum);
    }
  }
  if (in.rinsed) wash(p.rinse_time);
  if (in.wiped) {
    wash(p.wipe_time);
    const auto taken = static_cast<float>(1.0 - 1.0 / (1.0 + in.dt / p.wipe_time)) * in.wiped_on_blood;
    for (std::size_t i = 0; i < s.soiling.size() && taken > 0; ++i) {
      s.soiling[i] += taken;  // as much as the wiping left room for
      s.blood[i] += taken / s.soiling[i] * (1 - s.blood[i]);
    }
  }
  if (in.outside) wash(0.4);
  for (std::size_t i = 0; i < s.soiling.size(); ++i)
    if (s.soiling[i] < 1e-4f) s.soiling[i] = s.blood[i] = 0;
  double sum = 0;
  for (const float water : s.water) sum += static_cast<double>(water);
  s.condensate = sum / static_cast<double>(s.water.size());
  ++s.step;
  return Status::Ok;
}

namespace {
constexpr auto kEverything = [](auto& s, auto&& f) {
  f(&s.step, sizeof s.step), f(&s.temperature, sizeof s.temperature), f(&s.condensate, sizeof s.condensate);
  f(s.water.data(), sizeof s.water), f(s.soiling.data(), sizeof s.soiling), f(s.blood.data(), sizeof s.blood);
  f(s.runs.data(), sizeof s.runs);
};
}  // namespace

void save(const State& state, std::vector<std::uint8_t>& bytes) {
  effects::savePieces(state, kEverything, bytes);
}

bool restore(const std::uint8_t* bytes, std::size_t size, State& state) {
  State read;
  if (!effects::restorePieces(bytes, size, read, kEverything) ||
      !(read.temperature > 200 && read.temperature < 400) || !(read.condensate >= 0 && read.condensate <= 10))
    return false;
  for (std::size_t i = 0; i < read.soiling.size(); ++i)
    if (!(read.soiling[i] >= 0 && read.soiling[i] <= 1 && read.blood[i] >= 0 && read.blood[i] <= 1 &&
          read.water[i] >= 0 && read.water[i] <= 10))
      return false;
  for (const Run& run : read.runs)
    if (!(std::fabs(run.u) <= 2 && std::fabs(run.v) <= 2 && run.mass >= 0 && run.mass <= 1 &&
          run.blood >= 0 && run.blood <= 1))
      return false;
  state = read;
  return true;
}

}  // namespace vest::lens

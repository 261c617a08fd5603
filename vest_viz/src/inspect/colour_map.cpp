#include "vest_viz/inspect/colour_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vest::inspect {

Colour valueColour(float t) {
  if (std::isnan(t)) return {0.5f, 0.5f, 0.5f};
  constexpr int kStops = 5;
  constexpr Colour kStop[kStops] = {{0.16f, 0.09f, 0.36f},
                                    {0.11f, 0.35f, 0.53f},
                                    {0.13f, 0.60f, 0.49f},
                                    {0.55f, 0.79f, 0.28f},
                                    {0.99f, 0.91f, 0.27f}};
  const float s = std::clamp(t, 0.0f, 1.0f) * (kStops - 1);
  const int i = std::min(static_cast<int>(s), kStops - 2);
  const float f = s - static_cast<float>(i);
  Colour c;
  for (std::size_t k = 0; k < 3; ++k) c[k] = kStop[i][k] + f * (kStop[i + 1][k] - kStop[i][k]);
  return c;
}

Colour nameColour(const std::string& name) {
  std::uint32_t h = 2166136261u;  // FNV-1a
  for (char c : name) h = (h ^ static_cast<std::uint8_t>(c)) * 16777619u;
  h ^= h >> 15;
  h *= 2246822519u;
  h ^= h >> 13;
  const float hue = static_cast<float>(h & 1023u) / 1024.0f * 6.0f;
  const float saturation = 0.45f + 0.35f * static_cast<float>((h >> 10) & 255u) / 255.0f;
  const float value = 0.65f + 0.30f * static_cast<float>((h >> 18) & 255u) / 255.0f;
  Colour c;
  for (int k = 0; k < 3; ++k) {
    const float d = std::fabs(std::fmod(hue + 2.0f * static_cast<float>(k), 6.0f) - 3.0f) - 1.0f;
    c[static_cast<std::size_t>(k)] = value * (1.0f - saturation * (1.0f - std::clamp(d, 0.0f, 1.0f)));
  }
  return c;
}

Colour layerColour(unsigned layer) {
  if (layer == 0) return {0.75f, 0.62f, 0.56f};
  if (layer == 1) return {0.30f, 0.62f, 0.75f};
  return {0.85f, 0.20f, 0.15f};
}

std::vector<double> ticks(double low, double high, int most) {
  std::vector<double> out;
  if (!(low < high) || !std::isfinite(low) || !std::isfinite(high) || most < 2) return out;
  const double rough = (high - low) / most, power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = power;
  for (double factor : {1.0, 2.0, 5.0, 10.0}) {
    step = factor * power;
    if ((high - low) / step <= most - 1) break;
  }
  const double first = std::ceil(low / step - 1e-9);
  for (double i = first; i * step <= high + 1e-9 * step && out.size() < 100; ++i) out.push_back(i * step);
  return out;
}

std::array<double, 2> fittedScale(double low, double high, double least) {
  const double span = std::max(high - low, least);
  const double decade = std::pow(10.0, std::floor(std::log10(span / 2)));
  double step = 10 * decade;
  for (const double s : {5.0, 2.0, 1.0})
    if (s * decade >= span / 5) step = s * decade;
  constexpr double kRounding = 1e-6;  // of a step
  const double least_steps = std::max(2.0, std::ceil(least / step - kRounding));
  const double from = step * std::floor(low / step + kRounding);
  return {from, std::max(step * std::ceil(high / step - kRounding), from + least_steps * step)};
}

}  // namespace vest::inspect

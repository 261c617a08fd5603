#include "vest_viz/texture/noise.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/noise.hpp>
#include <glm/vec2.hpp>

namespace vest::texture {
namespace {
std::uint32_t mix(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}
}  // namespace

std::uint32_t Random::next() {
  state_ += 0x9e3779b9u;
  return mix(state_);
}

float periodicFbm(float u, float v, int fu, int fv, int octaves, std::uint32_t seed) {
  float sum = 0, amplitude = 1, total = 0;
  for (int o = 0; o < octaves; ++o) {
    // A shift by whole cells keeps the period and decorrelates seeds and octaves.
    const float su = static_cast<float>(mix(seed + 31u * o) % 61u),
                sv = static_cast<float>(mix(seed + 77u * o) % 59u);
    sum += amplitude * glm::perlin(glm::vec2(u * fu + su, v * fv + sv), glm::vec2(fu, fv));
    total += amplitude;
    amplitude *= 0.5f;
    fu *= 2;
    fv *= 2;
  }
  return 1.6f * sum / total;
}

float periodicTurbulence(float u, float v, int fu, int fv, int octaves, std::uint32_t seed) {
  float sum = 0, amplitude = 1, total = 0;
  for (int o = 0; o < octaves; ++o) {
    sum += amplitude * std::fabs(periodicFbm(u, v, fu, fv, 1, seed + 101u * o));
    total += amplitude;
    amplitude *= 0.55f;
    fu *= 2;
    fv *= 2;
  }
  return sum / total;
}

Cell periodicCell(float u, float v, int cells, std::uint32_t seed) {
  const float x = u * cells, y = v * cells;
  const int cx = static_cast<int>(std::floor(x)), cy = static_cast<int>(std::floor(y));
  Cell cell{9, 9, 0};
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      const int wx = ((cx + i) % cells + cells) % cells, wy = ((cy + j) % cells + cells) % cells;
      const std::uint32_t h =
          mix(seed ^ mix(static_cast<std::uint32_t>(wx) * 7919u + static_cast<std::uint32_t>(wy)));
      const float px = cx + i + 0.1f + 0.8f * (h & 0xffffu) / 65535.0f,
                  py = cy + j + 0.1f + 0.8f * (h >> 16) / 65535.0f;
      const float d = std::sqrt((px - x) * (px - x) + (py - y) * (py - y));
      if (d < cell.nearest) {
        cell.second = cell.nearest;
        cell.nearest = d;
        cell.id = h;
      } else {
        cell.second = std::min(cell.second, d);
      }
    }
  return cell;
}

}  // namespace vest::texture

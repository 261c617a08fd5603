#include "vest_effects/smoke/noise.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace vest::smoke {
namespace {

/// The published permutation of 0 … 255.
constexpr std::array<std::uint8_t, 256> kPermutation = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

int entry(int i) {
  return kPermutation[static_cast<std::size_t>(i) & 255u];
}
double fade(double t) {
  return t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
}
double between(double t, double a, double b) {
  return a + t * (b - a);
}
/// One of twelve directions to the edges of a cube (four of them twice), times the offset.
double slope(int hash, double x, double y, double z) {
  const int h = hash & 15;
  const double u = h < 8 ? x : y, v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1) == 0 ? u : -u) + ((h & 2) == 0 ? v : -v);
}

}  // namespace

double periodicNoise(double x, double y, double z, int period) {
  const int mask = period - 1;
  const double fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  const int x0 = static_cast<int>(static_cast<long long>(fx) & mask), x1 = (x0 + 1) & mask,
            y0 = static_cast<int>(static_cast<long long>(fy) & mask), y1 = (y0 + 1) & mask,
            z0 = static_cast<int>(static_cast<long long>(fz) & mask), z1 = (z0 + 1) & mask;
  x -= fx, y -= fy, z -= fz;
  const double u = fade(x), v = fade(y), w = fade(z);
  // The reference adds before it looks up; with a period below 256 the next corner wraps first.
  const auto corner = [](int i, int j, int k) { return entry(entry(entry(i) + j) + k); };
  const double low =
      between(v, between(u, slope(corner(x0, y0, z0), x, y, z), slope(corner(x1, y0, z0), x - 1, y, z)),
              between(u, slope(corner(x0, y1, z0), x, y - 1, z), slope(corner(x1, y1, z0), x - 1, y - 1, z)));
  const double high = between(
      v, between(u, slope(corner(x0, y0, z1), x, y, z - 1), slope(corner(x1, y0, z1), x - 1, y, z - 1)),
      between(u, slope(corner(x0, y1, z1), x, y - 1, z - 1), slope(corner(x1, y1, z1), x - 1, y - 1, z - 1)));
  return between(w, low, high);
}

double noise(double x, double y, double z) {
  return periodicNoise(x, y, z, 256);
}

double turbulence(double x, double y, double z, int octaves, int period) {
  double sum = 0, scale = 1;
  for (int k = 0; k < octaves; ++k) {
    sum += std::fabs(periodicNoise(x * scale, y * scale, z * scale, period)) / scale;
    scale *= 2;
    if (period < 256) period *= 2;
  }
  return sum;
}

}  // namespace vest::smoke

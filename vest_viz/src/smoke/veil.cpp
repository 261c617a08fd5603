#include "vest_viz/smoke/veil.h"

#include <algorithm>
#include <cmath>

#include <glm/gtc/noise.hpp>
#include <glm/vec3.hpp>
#include <opencv2/imgproc.hpp>

#include "vest_viz/effects/shapes.h"
#include "vest_viz/picture/finish.h"

namespace vest::smoke {
namespace {

constexpr int kNoise = 32;       // cells per edge of the turbulence cube
constexpr double kTile = 0.045;  // m: edge of the cube; assumed, by eye
constexpr double kRise = 0.006;  // m/s: how fast the pattern rises; assumed
constexpr int kSteps = 20, kCoarse = 8;
constexpr double kFar = 0.30;  // m: depth of code 0

constexpr float kFray = 1.8f / 255;  // cells that turbulence moves smoke aside, over its range (by eye)
constexpr float kMean = 110;         // of the turbulence, about

/// Trilinear between the middles of cells. @param at cells
float between(const Field& f, const Eigen::Vector3f& at) {
  std::size_t low[3], high[3];
  float part[3];
  for (int k = 0; k < 3; ++k) {
    const float x = std::clamp(at[k] - 0.5f, 0.0f, static_cast<float>(f.size[k] - 1));
    low[k] = static_cast<std::size_t>(x), high[k] = std::min<std::size_t>(low[k] + 1, f.size[k] - 1);
    part[k] = x - static_cast<float>(low[k]);
  }
  const auto along = [&](std::size_t y, std::size_t z) {
    const std::uint8_t* r = f.density.data() + (z * f.size[1] + y) * f.size[0];
    return static_cast<float>(r[low[0]]) + part[0] * static_cast<float>(r[high[0]] - r[low[0]]);
  };
  const auto across = [&](std::size_t z) {
    const float a = along(low[1], z);
    return a + part[1] * (along(high[1], z) - a);
  };
  const float a = across(low[2]);
  return a + part[2] * (across(high[2]) - a);
}

/// Box (cells) outside of which there is none: rays are marched within it alone.
void smoky(const Field& f, Eigen::Vector3f* low, Eigen::Vector3f* high) {
  std::uint32_t from[3] = {f.size[0], f.size[1], f.size[2]}, to[3] = {0, 0, 0};
  std::size_t i = 0;
  for (std::uint32_t z = 0; z < f.size[2]; ++z)
    for (std::uint32_t y = 0; y < f.size[1]; ++y)
      for (std::uint32_t x = 0; x < f.size[0]; ++x, ++i) {
        if (f.density[i] == 0) continue;
        const std::uint32_t at[3] = {x, y, z};
        for (int k = 0; k < 3; ++k) from[k] = std::min(from[k], at[k]), to[k] = std::max(to[k], at[k] + 1);
      }
  for (int k = 0; k < 3; ++k) {  // a cell more on each side: half for the interpolation, half for the whirls
    (*low)[k] = std::max(0.0f, static_cast<float>(from[k]) - 1);
    (*high)[k] = std::min(static_cast<float>(f.size[k]), static_cast<float>(to[k]) + 1);
  }
}

}  // namespace

bool Field::valid() const {
  const std::uint64_t cells = static_cast<std::uint64_t>(size[0]) * size[1] * size[2];
  return origin.allFinite() && std::isfinite(cell) && cell > 0 && std::isfinite(scale) && scale >= 0 &&
         std::max({size[0], size[1], size[2]}) < 2048 && cells > 0 && cells == density.size();
}

Veil::Veil() {
  noise_.resize(static_cast<std::size_t>(kNoise) * kNoise * kNoise);
  std::size_t i = 0;
  for (int z = 0; z < kNoise; ++z)
    for (int y = 0; y < kNoise; ++y)
      for (int x = 0; x < kNoise; ++x, ++i) {
        float sum = 0, weight = 1;
        for (int octave = 0, waves = 3; octave < 4; ++octave, waves *= 2, weight *= 0.55f)
          sum += weight * std::fabs(glm::perlin(glm::vec3(x, y, z) * (static_cast<float>(waves) / kNoise),
                                                glm::vec3(static_cast<float>(waves))));
        noise_[i] = static_cast<std::uint8_t>(255 * std::clamp(1.9f * sum, 0.0f, 1.0f));
      }
}

void Veil::draw(const Field& field, const camera::Intrinsics& source, const Eigen::Isometry3d& X_WO,
                const cv::Mat& rendering, double time, double light, cv::Mat* out) {
  out->release();
  if (!field.valid() || !X_WO.matrix().allFinite() || rendering.type() != CV_8UC4) return;
  const std::uint8_t most = *std::max_element(field.density.begin(), field.density.end());
  if (most == 0 || field.scale * kFar * effects::kSmokeExtinction * most / 255 < 0.004) return;
  const int w = std::max(1, rendering.cols / kCoarse), h = std::max(1, rendering.rows / kCoarse);
  out->create(h, w, CV_8UC4);
  const Eigen::Vector3f lower = field.origin.cast<float>();
  Eigen::Vector3f low, high;
  smoky(field, &low, &high);
  const auto per_cell = static_cast<float>(1 / field.cell);
  const Eigen::Vector3f eye = ((X_WO.translation() - field.origin) * per_cell).cast<float>();
  const Eigen::Matrix3f R = X_WO.linear().cast<float>();
  const auto to_noise = static_cast<float>(field.cell / kTile * kNoise);
  const auto shift = static_cast<float>(time * kRise / kTile * kNoise);
  const auto extinction = static_cast<float>(effects::kSmokeExtinction * field.scale / 255);
  const auto light_now = static_cast<float>(light);
  const float noise_x = lower.x() * per_cell * to_noise, noise_y = lower.y() * per_cell * to_noise,
              noise_z = lower.z() * per_cell * to_noise - shift;
  const auto turbulence = [&](float x, float y, float z) {
    const auto wrap = [](float v) { return static_cast<int>(std::floor(v)) & (kNoise - 1); };
    return static_cast<float>(
        noise_[static_cast<std::size_t>((wrap(z) * kNoise + wrap(y)) * kNoise + wrap(x))]);
  };
  for (int y = 0; y < h; ++y) {
    cv::Vec4b* row = out->ptr<cv::Vec4b>(y);
    for (int x = 0; x < w; ++x) {
      const int px = std::min(rendering.cols - 1, x * kCoarse + kCoarse / 2),
                py = std::min(rendering.rows - 1, y * kCoarse + kCoarse / 2);
      const double depth = picture::codedDepth(rendering.at<cv::Vec4b>(py, px)[3]);
      const Eigen::Vector3f ray(static_cast<float>((px - source.cx) / source.fx),
                                static_cast<float>((py - source.cy) / source.fy), 1.0f);
      const Eigen::Vector3f d = R * ray * per_cell;  // cells per metre of depth
      // Between the planes of the box, before the tissue.
      float from = 0.004f, to = static_cast<float>(depth);
      for (int k = 0; k < 3; ++k) {
        const float inverse = 1.0f / (std::fabs(d[k]) < 1e-9f ? 1e-9f : d[k]);
        const float a = (low[k] - eye[k]) * inverse, b = (high[k] - eye[k]) * inverse;
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
      }
      // The lamp's beam, as in ogre_media/tissue.vert: the cosine's eighth power.
      const float beam2 = 1 / ray.squaredNorm(), beam = light_now * beam2 * beam2 * beam2 * beam2;
      float clear = 1, lit = 0;
      if (to > from) {
        const float step = (to - from) / kSteps, length = step * ray.norm();
        // Jittered starts turn bands into grain, which the coarse grid's interpolation smooths away.
        float z = from + step * (0.25f + 0.5f * static_cast<float>((x * 7 + y * 3) % 5) / 4);
        for (int s = 0; s < kSteps; ++s, z += step) {
          const Eigen::Vector3f c = eye + z * d;
          const Eigen::Vector3f n(c.x() * to_noise + noise_x, c.y() * to_noise + noise_y,
                                  c.z() * to_noise + noise_z);
          // Whirls smaller than a cell, which the field does not know, fray what it knows as smooth.
          const float rho = between(
              field,
              {c.x() + kFray * (turbulence(0.4f * n.x(), 0.4f * n.y() + 11, 0.4f * n.z()) - kMean),
               c.y() + kFray * (turbulence(0.4f * n.x() + 17, 0.4f * n.y(), 0.4f * n.z()) - kMean), c.z()});
          if (rho <= 0) continue;
          const float swirl = turbulence(n.x(), n.y(), n.z()) / kMean;
          const float tau = extinction * rho * swirl * length;
          const float stopped = clear * (1 - 1 / (1 + tau + 0.5f * tau * tau));
          const float fall = beam / (z * z + 0.0012f);
          lit += stopped * fall / (1 + 0.55f * fall);
          clear -= stopped;
          if (clear < 0.01f) break;
        }
      }
      const float opacity = 1 - clear;
      const float tone = opacity > 1e-4f ? lit / opacity : 0;
      const auto level = static_cast<std::uint8_t>(255 * std::min(1.0f, std::sqrt(0.62f * tone)));
      row[x] = {level, static_cast<std::uint8_t>(level * 248 / 255),
                static_cast<std::uint8_t>(level * 242 / 255), static_cast<std::uint8_t>(255 * opacity)};
    }
  }
  cv::GaussianBlur(*out, *out, {3, 3}, 0);
}

}  // namespace vest::smoke

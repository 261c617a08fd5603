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
  if (!field.valid() || rendering.type() != CV_8UC4) return;
  const std::uint8_t most = *std::max_element(field.density.begin(), field.density.end());
  if (most == 0 || field.scale * kFar * effects::kSmokeExtinction * most / 255 < 0.004) return;
  const int w = std::max(1, rendering.cols / kCoarse), h = std::max(1, rendering.rows / kCoarse);
  out->create(h, w, CV_8UC4);
  const Eigen::Vector3f lower = field.origin.cast<float>();
  const auto cells = Eigen::Vector3f(static_cast<float>(field.size[0]), static_cast<float>(field.size[1]),
                                     static_cast<float>(field.size[2]));
  const auto per_cell = static_cast<float>(1 / field.cell);
  const Eigen::Vector3f eye = ((X_WO.translation() - field.origin) * per_cell).cast<float>();
  const Eigen::Matrix3f R = X_WO.linear().cast<float>();
  const auto to_noise = static_cast<float>(field.cell / kTile * kNoise);
  const auto shift = static_cast<float>(time * kRise / kTile * kNoise);
  const auto extinction = static_cast<float>(effects::kSmokeExtinction * field.scale / 255);
  const auto stride_y = static_cast<int>(field.size[0]),
             stride_z = static_cast<int>(field.size[0] * field.size[1]);
  const auto light_now = static_cast<float>(light);
  const float lx = lower.x() * per_cell, ly = lower.y() * per_cell, lz = lower.z() * per_cell;
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
        const float a = -eye[k] * inverse, b = (cells[k] - eye[k]) * inverse;
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
          const int cx = static_cast<int>(c.x()), cy = static_cast<int>(c.y()), cz = static_cast<int>(c.z());
          if (c.x() < 0 || c.y() < 0 || c.z() < 0 || cx >= stride_y ||
              cy >= static_cast<int>(field.size[1]) || cz >= static_cast<int>(field.size[2]))
            continue;
          // Trilinear between cell middles would cost eight reads; the turbulence hides the cells.
          const float rho = field.density[static_cast<std::size_t>(cz * stride_z + cy * stride_y + cx)];
          if (rho == 0) continue;
          const int nx = static_cast<int>(std::floor((c.x() + lx) * to_noise)) & (kNoise - 1);
          const int ny = static_cast<int>(std::floor((c.y() + ly) * to_noise)) & (kNoise - 1);
          const int nz = static_cast<int>(std::floor((c.z() + lz) * to_noise - shift)) & (kNoise - 1);
          const float swirl =
              noise_[static_cast<std::size_t>((nz * kNoise + ny) * kNoise + nx)] * (1.0f / 110.0f);
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

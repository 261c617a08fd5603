#include "vest_viz/picture/finish.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vest::picture {
namespace {
constexpr double kRimWidth = 2.2;  // pixels at 576 lines; by eye
/// Enlarging blurs. Of a rendering with fewer pixels than this share along an edge a part is given back, as
/// the aperture correction of a camera does: the contrast at 1-3 px of a live session's pictures was 0.039
/// with a part of 0.3 and is 0.044 with 0.5 (real frames: 0.045 and more).
constexpr double kSharpBelow = 0.62, kSharpening = 0.5;
/// A highlight: green of the lamp's image, and what undoes the response of the shaders for it, roughly (by
/// eye).
constexpr int kWhite = 224, kGlare = 8;
constexpr int kRim = 5;  // the same for a highlight's rim that is enlarged: it keeps its size (by eye)
}  // namespace

Finisher::Finisher(const camera::Intrinsics& camera, double share, double resolution) : camera_(camera) {
  share = std::clamp(share, 0.3, 1.5);
  circle_.cx = camera.cx;
  circle_.cy = camera.cy;
  circle_.radius = share * 0.5 * camera.height;
  // Farthest undistorted direction on the circle, inside the frame.
  double reach = 0;
  for (int i = 0; i < 720; ++i) {
    const double a = i * 3.14159265358979 / 360;
    const double x = std::clamp(circle_.cx + circle_.radius * std::cos(a), 0.0, camera.width - 1.0);
    const double y = std::clamp(circle_.cy + circle_.radius * std::sin(a), 0.0, camera.height - 1.0);
    const Eigen::Vector2d n = camera::unproject(camera, {x, y});
    reach = std::max(reach, n.norm());
  }
  const double half = 1.01 * reach;
  // As many pixels per edge as the circle has, so that the middle is not blurred.
  const auto edge =
      static_cast<std::uint32_t>(2 * std::ceil(circle_.radius * 1.02 * std::clamp(resolution, 0.4, 2.0)));
  source_ = camera::fromFieldOfView(edge, edge, 2 * std::atan(half), {0, 0, 0, 0, 0});
  source_radius_ = reach / half;
  sharpening_ = resolution < kSharpBelow ? kSharpening : 0;
  if (resolution < 1) {
    light_.create(1, 256, CV_16U);
    for (int i = 0; i < 256; ++i)
      light_.at<std::uint16_t>(0, i) = static_cast<std::uint16_t>(i + kRim * std::max(0, i - kWhite));
  }

  const int x0 = std::max(0, static_cast<int>(circle_.cx - circle_.radius) - 2);
  const int y0 = std::max(0, static_cast<int>(circle_.cy - circle_.radius) - 2);
  const int x1 = std::min(static_cast<int>(camera.width), static_cast<int>(circle_.cx + circle_.radius) + 3);
  const int y1 = std::min(static_cast<int>(camera.height), static_cast<int>(circle_.cy + circle_.radius) + 3);
  window_ = cv::Rect(x0, y0, x1 - x0, y1 - y0);
  cv::Mat mx(window_.size(), CV_32F), my(window_.size(), CV_32F);
  weight_.create(window_.size(), CV_8UC3);
  rim_.create(window_.size(), CV_8UC3);
  const double rim = kRimWidth * camera.height / 576.0;
  for (int y = 0; y < window_.height; ++y)
    for (int x = 0; x < window_.width; ++x) {
      const double px = x + x0, py = y + y0, r = std::hypot(px - circle_.cx, py - circle_.cy);
      Eigen::Vector2d n(0, 0);
      if (r < circle_.radius + 2) n = camera::unproject(camera, {px, py});
      const Eigen::Vector2d s = camera::project(source_, n);
      mx.at<float>(y, x) = static_cast<float>(s.x());
      my.at<float>(y, x) = static_cast<float>(s.y());
      // Field stop: soft over two pixels; natural vignetting towards the edge.
      const double inside = std::clamp(circle_.radius - rim - r + 0.5, 0.0, 1.0);
      const double q = r / circle_.radius, fade = 1.0 - 0.50 * q * q * q * q;
      const auto w = static_cast<std::uint8_t>(255 * inside * fade);
      weight_.at<cv::Vec3b>(y, x) = {w, w, w};
      // The stop's polished edge catches some light, unevenly round the circle.
      const double ring =
          std::clamp(1.0 - std::fabs(r - (circle_.radius - 0.5 * rim)) / (0.5 * rim + 0.5), 0.0, 1.0);
      const double around = 0.72 + 0.28 * std::cos(std::atan2(py - circle_.cy, px - circle_.cx) * 2 + 0.7);
      const double g = 150 * ring * around;
      const double seen = (255 - w) / 255.0;  // what the picture leaves of it
      rim_.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(seen * g),
                                  static_cast<std::uint8_t>(0.72 * seen * g),
                                  static_cast<std::uint8_t>(0.62 * seen * g)};
    }
  cv::convertMaps(mx, my, map_, map_fraction_, CV_16SC2);
}

double codedDepth(std::uint8_t code) {
  const double root = 1.0 - code / 255.0;
  return 0.3 * root * root;
}

std::array<double, 3> whiteBalance(double lamp, double white) {
  constexpr double kSecond = 0.0143877688;  // m·K, second radiation constant h·c/k (CODATA 2018)
  constexpr double kWave[] = {610e-9, 545e-9, 465e-9};
  lamp = std::clamp(lamp, 1500.0, 20000.0);
  white = std::clamp(white, 1500.0, 20000.0);
  std::array<double, 3> gain{};
  for (int i = 0; i < 3; ++i)
    gain[i] = std::expm1(kSecond / (kWave[i] * white)) / std::expm1(kSecond / (kWave[i] * lamp));
  return {gain[0] / gain[1], 1.0, gain[2] / gain[1]};
}

void Finisher::setLook(const CameraLook& look) {
  look_ = look;
  white_.release();
  const std::array<double, 3> gain = whiteBalance(look.lamp, look.white_balance);
  if (std::fabs(gain[0] - 1) > 0.004 || std::fabs(gain[2] - 1) > 0.004) {
    white_.create(1, 256, CV_8UC3);
    for (int i = 0; i < 256; ++i)
      for (int c = 0; c < 3; ++c)  // the picture is coded by a square root: factors on light act by theirs
        white_.at<cv::Vec3b>(0, i)[c] = cv::saturate_cast<std::uint8_t>(i * std::sqrt(gain[c]));
  }
  noise_.release();
  if (look.noise > 0) {
    noise_.create(1, 1 << 17, CV_8S);
    cv::RNG rng(7);
    rng.fill(noise_, cv::RNG::NORMAL, 0, std::min(look.noise, 30.0));
  }
}

void Finisher::setLens(const Lens& lens) {
  fog_ = std::isfinite(lens.fog) ? std::clamp(lens.fog, 0.0, 1.0) : 0.0;
  soil_.release(), fogging_.release();
  const std::size_t cells =
      static_cast<std::size_t>(std::max(lens.columns, 0)) * static_cast<std::size_t>(std::max(lens.rows, 0));
  if (cells > 0 && cells <= 4000000 && lens.fogging.size() == cells && fog_ > 0) {
    const cv::Mat map(lens.rows, lens.columns, CV_8U, const_cast<std::uint8_t*>(lens.fogging.data()));
    cv::Mat all;
    cv::resize(map, all, {static_cast<int>(camera_.width), static_cast<int>(camera_.height)}, 0, 0,
               cv::INTER_LINEAR);
    cv::GaussianBlur(all, all, {0, 0}, 0.012 * camera_.height);
    fogging_ = all(window_).clone();
  }
  if (cells == 0 || cells > 4000000 || lens.soiling.size() != cells) return;
  if (std::all_of(lens.soiling.begin(), lens.soiling.end(), [](std::uint8_t v) { return v == 0; })) return;
  const cv::Mat map(lens.rows, lens.columns, CV_8U, const_cast<std::uint8_t*>(lens.soiling.data()));
  cv::Mat all;
  const cv::Size size(static_cast<int>(camera_.width), static_cast<int>(camera_.height));
  cv::resize(map, all, size, 0, 0, cv::INTER_LINEAR);
  // What lies on the lens is far out of focus.
  const double blur = 0.012 * camera_.height;
  cv::GaussianBlur(all, all, {0, 0}, blur);
  soil_ = all(window_).clone();
  cv::Mat red = cv::Mat::zeros(size, CV_8U);
  if (lens.blood.size() == cells) {
    const cv::Mat blood(lens.rows, lens.columns, CV_8U, const_cast<std::uint8_t*>(lens.blood.data()));
    cv::resize(blood, red, size, 0, 0, cv::INTER_LINEAR);
    cv::GaussianBlur(red, red, {0, 0}, blur);
  }
  red = red(window_);
  soil_colour_.create(window_.size(), CV_8UC3);
  for (int y = 0; y < window_.height; ++y)
    for (int x = 0; x < window_.width; ++x) {
      const int b = red.at<std::uint8_t>(y, x);
      // Factors on what shines through: blood keeps the red alone, water and soot dim a little.
      soil_colour_.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(215 - 85 * b / 255),
                                          static_cast<std::uint8_t>(212 - 200 * b / 255),
                                          static_cast<std::uint8_t>(208 - 197 * b / 255)};
    }
}

void Finisher::resample() {
  cv::extractChannel(rgb_, near_white_, 1);
  cv::threshold(near_white_, near_white_, kWhite, 255, cv::THRESH_BINARY);
  cv::dilate(near_white_, near_white_, {});
  cv::LUT(rgb_, light_, glare_);
  cv::GaussianBlur(glare_, glare_, {3, 3}, 0);
  if (sharpening_ > 0) {
    cv::GaussianBlur(rgb_, blurred_, {3, 3}, 0);
    cv::addWeighted(rgb_, 1 + sharpening_, blurred_, -sharpening_, 0, rgb_);
  }
  glare_.convertTo(blurred_, CV_8U);
  blurred_.copyTo(rgb_, near_white_);
}

void Finisher::blendVeil(const cv::Mat& veil) {
  cv::resize(veil, veil_, rgb_.size(), 0, 0, cv::INTER_LINEAR);
  for (int y = 0; y < rgb_.rows; ++y) {
    std::uint8_t* p = rgb_.ptr<std::uint8_t>(y);
    const std::uint8_t* v = veil_.ptr<std::uint8_t>(y);
    for (int x = 0; x < rgb_.cols; ++x, p += 3, v += 4) {
      const int a = v[3];
      for (int k = 0; k < 3; ++k) p[k] = static_cast<std::uint8_t>(p[k] + (((v[k] - p[k]) * a + 128) >> 8));
    }
  }
}

void Finisher::defocus() {
  // Circle of confusion of a thin lens: aperture · focal length · |1/z - 1/focus|; a share of 1 is a blur of
  // kBlur pixels at 588. An endoscope's aperture is small: at 5 cm it is sharp from some 3 to 10 cm
  // (assumed).
  constexpr double kPerDioptre = 1.0 / 26.0, kTolerated = 9.0;  // m, 1/m
  std::uint8_t share[256];
  for (int i = 0; i < 256; ++i) {
    const double z = std::max(codedDepth(static_cast<std::uint8_t>(i)), 0.002);
    const double off = std::max(0.0, std::fabs(1 / z - 1 / look_.focus) - kTolerated);
    share[i] = static_cast<std::uint8_t>(255 * std::min(1.0, off * kPerDioptre));
  }
  cv::resize(rgb_, small_, {rgb_.cols / 2, rgb_.rows / 2}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(small_, small_, {0, 0}, 2.2 * rgb_.rows / 588.0);
  cv::resize(small_, blurred_, rgb_.size(), 0, 0, cv::INTER_LINEAR);
  // Blur reaches over edges: the mask is blurred too.
  cv::LUT(depth_, cv::Mat(1, 256, CV_8U, share), depth_);
  cv::blur(depth_, depth_, {5, 5});
  for (int y = 0; y < rgb_.rows; ++y) {
    std::uint8_t* p = rgb_.ptr<std::uint8_t>(y);
    const std::uint8_t* q = blurred_.ptr<std::uint8_t>(y);
    const std::uint8_t* m = depth_.ptr<std::uint8_t>(y);
    for (int x = 0; x < rgb_.cols; ++x, p += 3, q += 3)
      for (int k = 0; k < 3; ++k)
        p[k] = static_cast<std::uint8_t>(p[k] + (((q[k] - p[k]) * m[x] + 128) >> 8));
  }
}

void Finisher::cloud() {
  // Droplets of condensate scatter: contrast goes, a grey veil in the colour of the scene comes.
  const int scale = 8;
  cv::resize(warped_, small_, {warped_.cols / scale, warped_.rows / scale}, 0, 0, cv::INTER_AREA);
  const cv::Scalar mean = cv::mean(small_);
  cv::GaussianBlur(small_, small_, {0, 0}, 1.0 + 4.0 * fog_);
  cv::resize(small_, blurred_, warped_.size(), 0, 0, cv::INTER_LINEAR);
  // By fog: what its droplets scatter grows with their number.
  struct Level {
    int f, keep, add[3];
  };
  const auto levelOf = [&](double fog) {
    Level level{};
    const double veil = 0.6 * fog;
    for (int k = 0; k < 3; ++k)
      level.add[k] =
          static_cast<int>(veil * (0.45 * mean[k] + 0.35 * (mean[0] + mean[1] + mean[2]) / 3 + 40));
    level.f = static_cast<int>(256 * std::min(1.0, 1.4 * fog)),
    level.keep = static_cast<int>(256 * (1 - veil));
    return level;
  };
  std::array<Level, 256> levels{};
  for (std::size_t i = 0; i < levels.size() && !fogging_.empty(); ++i)
    levels[i] = levelOf(static_cast<double>(i) / 255);
  const Level same = levelOf(fog_);
  for (int y = 0; y < warped_.rows; ++y) {
    std::uint8_t* p = warped_.ptr<std::uint8_t>(y);
    const std::uint8_t* q = blurred_.ptr<std::uint8_t>(y);
    const std::uint8_t* soil = soil_.empty() ? nullptr : soil_.ptr<std::uint8_t>(y);
    const std::uint8_t* tone = soil_.empty() ? nullptr : soil_colour_.ptr<std::uint8_t>(y);
    const std::uint8_t* fog = fogging_.empty() ? nullptr : fogging_.ptr<std::uint8_t>(y);
    for (int x = 0; x < warped_.cols; ++x, p += 3, q += 3) {
      const int opaque = soil != nullptr ? soil[x] : 0;
      const Level& here = fog != nullptr ? levels[fog[x]] : same;
      // A highlight is far brighter than the picture's white: it shines through the fog all the same. Its
      // green tells it from bright tissue, whose red alone is as high.
      const int glare = kGlare * std::max(0, p[1] - kWhite);
      for (int k = 0; k < 3; ++k) {
        const int shines = p[k] + glare;
        int value = shines + (((q[k] - shines) * here.f) >> 8);
        if (opaque != 0) value += (((q[k] * tone[3 * x + k] >> 8) - value) * opaque) >> 8;
        p[k] = static_cast<std::uint8_t>(std::min(255, (value * here.keep >> 8) + here.add[k]));
      }
    }
  }
}

void Finisher::apply(const cv::Mat& rendering, const cv::Mat& veil, cv::Mat* out) {
  if (out->rows != static_cast<int>(camera_.height) || out->cols != static_cast<int>(camera_.width) ||
      out->type() != CV_8UC3) {
    out->create(static_cast<int>(camera_.height), static_cast<int>(camera_.width), CV_8UC3);
    out->setTo(0);
  }
  cv::cvtColor(rendering, rgb_, cv::COLOR_RGBA2RGB);
  cv::extractChannel(rendering, depth_, 3);
  edges_.apply(depth_, &rgb_);
  if (!light_.empty()) resample();
  if (!veil.empty()) blendVeil(veil);
  if (look_.focus > 0) defocus();
  cv::remap(rgb_, warped_, map_, map_fraction_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  if (fog_ > 0.005 || !soil_.empty()) cloud();
  if (!white_.empty()) cv::LUT(warped_, white_, warped_);
  ++pictures_;
  for (int y = 0; y < window_.height; ++y) {
    const std::uint8_t* a = warped_.ptr<std::uint8_t>(y);
    const std::uint8_t* w = weight_.ptr<std::uint8_t>(y);
    const std::uint8_t* r = rim_.ptr<std::uint8_t>(y);
    std::uint8_t* o = out->ptr<std::uint8_t>(y + window_.y) + 3 * window_.x;
    for (int i = 0; i < 3 * window_.width; ++i) {  // in 16 bits: vectorises
      const auto shown = static_cast<std::uint16_t>(a[i] * static_cast<std::uint16_t>(w[i] + 1));
      o[i] = static_cast<std::uint8_t>((shown >> 8) + r[i]);
    }
    // What a lens loses towards its edge it loses before the picture's white: a highlight stays white there.
    for (int x = 0; x < window_.width; ++x) {
      const int i = 3 * x, glare = kGlare * (a[i + 1] - kWhite);
      if (glare <= 0) continue;
      for (int k = 0; k < 3; ++k)
        o[i + k] =
            static_cast<std::uint8_t>(std::min(255, ((a[i + k] + glare) * (w[i + k] + 1) >> 8) + r[i + k]));
    }
    if (noise_.empty()) continue;
    const auto width = static_cast<std::uint32_t>(3 * window_.width);
    const std::uint32_t room = static_cast<std::uint32_t>(noise_.cols) - width;
    const std::uint32_t start = (pictures_ * 40503u + static_cast<std::uint32_t>(y) * 2654435761u) % room;
    const auto* n = noise_.ptr<std::int8_t>(0) + start;
    for (std::uint32_t i = 0; i < width; ++i)
      if (w[i] > 127) o[i] = cv::saturate_cast<std::uint8_t>(o[i] + n[i]);
  }
}

double AutoExposure::update(const cv::Mat& rgb, const Circle& circle, double dt, double drawn) {
  int histogram[256] = {0}, count = 0;
  const double limit = 0.96 * circle.radius;
  for (int y = 1; y < rgb.rows; y += 4) {
    const double dy = y - circle.cy, half2 = limit * limit - dy * dy;
    if (half2 <= 0) continue;
    const int x0 = std::max(0, static_cast<int>(circle.cx - std::sqrt(half2)));
    const int x1 = std::min(rgb.cols, static_cast<int>(circle.cx + std::sqrt(half2)));
    const std::uint8_t* row = rgb.ptr<std::uint8_t>(y);
    for (int x = x0; x < x1; x += 4) {
      const std::uint8_t* p = row + 3 * x;
      ++histogram[(77 * p[0] + 150 * p[1] + 29 * p[2]) >> 8];
      ++count;
    }
  }
  if (count == 0) return gain_;
  int sum = 0, level = 255;
  for (; level > 0; --level)
    if ((sum += histogram[level]) > count / 4) break;
  // The 75 % level at 106, within vest_viz/docs/pictures.md's 96–134, for the overview as for a close organ.
  const double wanted = 101.0;
  const double ratio = std::pow(std::clamp(wanted / std::max(level, 4), 0.25, 4.0), 2.0);
  // The first pictures settle at once, as a camera does before anybody looks.
  const double follow = ++pictures_ < 12 ? 0.6 : 1.0 - std::exp(-std::clamp(dt, 0.0, 1.0) / 0.25);
  // Towards what that picture asks for. Corrected once for each picture on its way it would swing for ever.
  gain_ = std::clamp(gain_ * std::pow(drawn * ratio / gain_, follow), 0.02, 50.0);
  return gain_;
}

}  // namespace vest::picture

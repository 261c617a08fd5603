#include "vest_viz/picture/edges.h"

#include <algorithm>
#include <cstdlib>

namespace vest::picture {
namespace {

/// Codes of depth that make a border: 3.6 mm at 8 cm; rounding alone makes 2. A slanted surface grows as much
/// from pixel to pixel: the step must be more than twice the steps before and behind it.
constexpr int kJump = 3;
/// Levels of green (by eye: the gap of a closed jaw has 25). Textures are drawn between their texels: their
/// steps grow and fall more slowly.
constexpr int kContrast = 20;

inline std::uint8_t isBorder(int before, int a, int b, int behind, int least) {
  const int step = std::abs(b - a), around = std::max(std::abs(a - before), std::abs(behind - b));
  return static_cast<std::uint8_t>((step >= least) & (step > 2 * around));
}

/// Whether a pixel differs by `least` from those on both sides, which are alike: the gap of a closed jaw, a
/// tooth, the dark rim of a tube. Crests of texture are broader. No branch, so that it vectorises.
inline bool isThin(int before2, int before, int here, int behind, int behind2, int least) {
  const int a = here - before, b = here - behind, step = std::min(std::abs(a), std::abs(b));
  const int around = std::max(std::abs(before - before2), std::abs(behind - behind2));
  return (step >= least) & (a * b > 0) & (step > 2 * std::max(around, std::abs(before - behind)));
}

//// Whether a thin line belongs to the pattern of tissue. Its levels are mixed already, as far as a mip map
/// mixes them; where a line is a pixel wide at one place and two at the next, moving the first alone makes
/// dashes. Threads and steel are not red (by eye).
bool isVessel(const std::uint8_t* rgb) {
  return rgb[0] - std::max(rgb[1], rgb[2]) > 20;
}

// What the line cuts off of pixel k of a run of n: of the pixels above the border and of those below. The
/// line begins and ends half a pixel high or low, where the run steps up (1) or down (-1), and meets the
/// border in the middle of the run.
struct Parts {
  float above = 0, below = 0;
};
Parts cutOff(int k, int n, int left, int right) {
  const float middle = 0.5f * static_cast<float>(n), t0 = static_cast<float>(k), t1 = t0 + 1;
  Parts parts;
  const auto add = [&](int side, float area) { (side > 0 ? parts.above : parts.below) += area; };
  const auto under = [&](float a, float b) {  // of a line from 0.5 at 0 to 0 in the middle
    return 0.5f * (b - a) - (b * b - a * a) / (4 * middle);
  };
  if (left != 0 && t0 < middle) add(left, under(t0, std::min(t1, middle)));
  if (right != 0 && t1 > middle) {
    const float end = static_cast<float>(n);
    add(right, under(end - t1, end - std::max(t0, middle)));
  }
  return parts;
}

}  // namespace

void EdgeSmoother::apply(const cv::Mat& depth, cv::Mat* rgb) {
  const int width = depth.cols, height = depth.rows;
  if (width < 4 || height < 4) return;
  below_.create(height, width, CV_8U);
  beside_.create(height, width, CV_8U);
  any_row_.assign(static_cast<std::size_t>(height), 0);
  any_column_.assign(static_cast<std::size_t>(width), 0);
  cv::extractChannel(*rgb, green_, 1);
  for (int y : {0, height - 2, height - 1}) below_.row(y).setTo(0);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* d = depth.ptr<std::uint8_t>(y);
    std::uint8_t* beside = beside_.ptr<std::uint8_t>(y);
    std::uint8_t any = 0;
    const auto green = [this](int row) { return green_.ptr<std::uint8_t>(row); };
    const std::uint8_t* g = green(y);
    for (int x = 1; x + 2 < width; ++x)
      beside[x] = static_cast<std::uint8_t>(isBorder(d[x - 1], d[x], d[x + 1], d[x + 2], kJump) |
                                            isBorder(g[x - 1], g[x], g[x + 1], g[x + 2], kContrast));
    beside[0] = beside[width - 2] = beside[width - 1] = 0;
    for (int x = 0; x < width; ++x)
      any_column_[static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(any_column_[static_cast<std::size_t>(x)] | beside[x]);
    if (y < 1 || y + 2 >= height) continue;
    const std::uint8_t *up = depth.ptr<std::uint8_t>(y - 1), *down = depth.ptr<std::uint8_t>(y + 1),
                       *two = depth.ptr<std::uint8_t>(y + 2);
    const std::uint8_t *g_up = green(y - 1), *g_down = green(y + 1), *g_two = green(y + 2);
    std::uint8_t* below = below_.ptr<std::uint8_t>(y);
    for (int x = 0; x < width; ++x) {
      below[x] = static_cast<std::uint8_t>(isBorder(up[x], d[x], down[x], two[x], kJump) |
                                           isBorder(g_up[x], g[x], g_down[x], g_two[x], kContrast));
      any = static_cast<std::uint8_t>(any | below[x]);
    }
    any_row_[static_cast<std::size_t>(y)] = any;
  }
  rgb->copyTo(source_);
  findThin(depth);
  blend(true, rgb);
  blend(false, rgb);
  blendThin(true, rgb);
  blendThin(false, rgb);
}

void EdgeSmoother::findThin(const cv::Mat& depth) {
  thin_.create(depth.size(), CV_8U);
  thin_.setTo(0);
  const auto mark = [](const cv::Mat& plane, int y, int least, std::uint8_t* thin) {
    const auto row = [&](int i) { return plane.ptr<std::uint8_t>(y + i); };
    const std::uint8_t *p = row(0), *up2 = row(-2), *up = row(-1), *down = row(1), *down2 = row(2);
    const int end = plane.cols - 2;
    for (int x = 2; x < end; ++x) {
      const int across_rows = isThin(up2[x], up[x], p[x], down[x], down2[x], least);
      const int across_columns = isThin(p[x - 2], p[x - 1], p[x], p[x + 1], p[x + 2], least);
      thin[x] =
          static_cast<std::uint8_t>(thin[x] | across_rows * kAcrossRows | across_columns * kAcrossColumns);
    }
  };
  for (int y = 2; y + 2 < depth.rows; ++y) {
    std::uint8_t* thin = thin_.ptr<std::uint8_t>(y);
    mark(green_, y, kContrast, thin);
    const std::uint8_t* rgb = source_.ptr<std::uint8_t>(y);
    for (int x = 2; x + 2 < depth.cols; ++x)
      if (thin[x] != 0 && isVessel(rgb + 3 * x)) thin[x] = 0;
    mark(depth, y, kJump, thin);
  }
}

void EdgeSmoother::blendThin(bool rows, cv::Mat* rgb) {
  const int width = rows ? rgb->cols : rgb->rows, lines = rows ? rgb->rows : rgb->cols;
  const std::uint8_t way = rows ? kAcrossRows : kAcrossColumns;
  const auto thin = [&](int x, int y) {
    return rows ? thin_.at<std::uint8_t>(y, x) : thin_.at<std::uint8_t>(x, y);
  };
  const auto pixel = [rows](cv::Mat& m, int x, int y) -> std::uint8_t* {
    return rows ? m.ptr<std::uint8_t>(y, x) : m.ptr<std::uint8_t>(x, y);
  };
  for (int y = 2; y + 2 < lines; ++y) {
    for (int x = 2; x + 3 < width; ++x) {
      if ((thin(x, y) & way) == 0) continue;
      const int first = x;
      while (x + 3 < width && (thin(x, y) & way) != 0) ++x;  // x: one behind the run
      const auto step = [&](int beside) {                    // 1: the line goes on one row above, -1: below
        return ((thin(beside, y - 1) & way) != 0) - ((thin(beside, y + 1) & way) != 0);
      };
      const int near_left = step(first - 1), near_right = step(x);
      const int left = near_left != 0 ? near_left : step(first - 2);
      const int right = near_right != 0 ? near_right : step(x + 1);
      const auto add = [&](int k, int to, float share, int of, int behind) {
        const std::uint8_t *line = pixel(source_, of, y), *ground = pixel(source_, of, behind);
        std::uint8_t* out = pixel(*rgb, k, to);
        for (int c = 0; c < 3; ++c)
          out[c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(out[c]) +
                                                   share * static_cast<float>(line[c] - ground[c]));
      };
      // A speck alone is less than a pixel.
      if (x - first == 1 && left == 0 && right == 0 && thin(first, y) == (kAcrossRows | kAcrossColumns)) {
        add(first, y, -0.25f, first, y - 1);
        continue;
      }
      for (int k = first; k < x; ++k) {
        const Parts parts = cutOff(k - first, x - first, left, right);
        for (const int side : {-1, 1}) {
          const float share = side < 0 ? parts.above : parts.below;
          if (share == 0) continue;
          add(k, y + side, share, k, y + side);
          add(k, y, -share, k, y + side);
        }
      }
      // No sample met the line where it steps.
      if (near_right == 0 && right != 0)
        for (const int to : {y, y - right}) add(x, to, 0.5f, x - 1, y - right);
    }
  }
}

void EdgeSmoother::blend(bool rows, cv::Mat* rgb) {
  // Words for rows; along columns x and y change places.
  const int width = rows ? rgb->cols : rgb->rows, lines = rows ? rgb->rows : rgb->cols;
  const cv::Mat &along = rows ? below_ : beside_, &across = rows ? beside_ : below_;
  const auto at = [rows](const cv::Mat& m, int x, int y) {
    return rows ? m.at<std::uint8_t>(y, x) : m.at<std::uint8_t>(x, y);
  };
  const auto pixel = [rows](cv::Mat& m, int x, int y) -> std::uint8_t* {
    return rows ? m.ptr<std::uint8_t>(y, x) : m.ptr<std::uint8_t>(x, y);
  };
  for (int y = 1; y + 3 < lines; ++y) {
    if ((rows ? any_row_ : any_column_)[static_cast<std::size_t>(y)] == 0) continue;
    for (int x = 1; x + 1 < width; ++x) {
      if (at(along, x, y) == 0) continue;
      const int first = x;
      while (x + 1 < width && at(along, x, y) != 0) ++x;  // x: one behind the run
      const auto step = [&](int before) {                 // of the border between `before` and the next pixel
        return at(across, before, y) - at(across, before, y + 1);
      };
      const int left = step(first - 1), right = step(x - 1);
      if (left == 0 && right == 0) continue;
      // A run of one pixel is a step of a run of the other direction, which is smoothed there; or, where
      // those are as short, a diagonal.
      const auto longer = [&](int before, int side) {
        return side != 0 && at(across, before, side > 0 ? y - 1 : y + 2) != 0;
      };
      if (x - first == 1 && (left == right || longer(first - 1, left) || longer(x - 1, right))) continue;
      for (int k = first; k < x; ++k) {
        const Parts parts = cutOff(k - first, x - first, left, right);
        for (const int side : {0, 1}) {
          const float share = side == 0 ? parts.above : parts.below;
          if (share == 0) continue;
          const std::uint8_t *a = pixel(source_, k, y + side), *b = pixel(source_, k, y + 1 - side);
          std::uint8_t* out = pixel(*rgb, k, y + side);
          for (int c = 0; c < 3; ++c)
            out[c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(out[c]) +
                                                     share * static_cast<float>(b[c] - a[c]));
        }
      }
    }
  }
}

}  // namespace vest::picture

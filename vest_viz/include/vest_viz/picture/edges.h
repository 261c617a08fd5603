#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vest::picture {

/// Takes the stairs from edges after the drawing: cheaper than drawing more pixels. Morphological
/// antialiasing (Reshetov, High-Performance Graphics 2009). A border is where the depth jumps (an instrument
/// before tissue), or the colour does from one pixel to the next (jaw before jaw, a vessel on its wall, the
/// rim of a highlight); texture is drawn softer than that, and stays as it is. A run of border between two
/// pixel rows that steps up or down at its ends stands for a line through the middle of the steps, and each
/// pixel takes as much of the colour beyond as the line cuts off. Lines one pixel wide are moved likewise. No
/// allocation after the first picture of a size.
class EdgeSmoother {
 public:
  /// @param depth CV_8U, codes as in the shaders' alpha; @param rgb CV_8UC3 of the same size
  void apply(const cv::Mat& depth, cv::Mat* rgb);

 private:
  /// Runs along rows; `rows` false: along columns.
  void blend(bool rows, cv::Mat* rgb);
  void findThin(const cv::Mat& depth);
  /// Lines a pixel wide, of source_, which else are rows of dashes; and specks, which else are dots: half
  /// stays.
  void blendThin(bool rows, cv::Mat* rgb);
  static constexpr std::uint8_t kAcrossRows = 1, kAcrossColumns = 2;
  cv::Mat thin_;            ///< CV_8U, bits: a pixel that differs from both rows, both columns beside it
  cv::Mat below_, beside_;  ///< CV_8U, 1: a border to the next row, to the next column
  std::vector<std::uint8_t> any_row_, any_column_;
  cv::Mat source_, green_;
};

}  // namespace vest::picture

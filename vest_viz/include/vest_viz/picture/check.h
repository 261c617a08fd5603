#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vest_viz/picture/finish.h"

namespace vest::picture {

/// One figure of a picture beside the range that real laparoscopies lie in.
struct Row {
  std::string what;
  double value = 0;
  double low = 0, high = 0;  ///< inclusive; infinite where there is no bound
  /// Range over the eight frames themselves, where it is narrower than low … high; for information, no
  /// verdict.
  double seen_low = 0, seen_high = 0;
  bool hasSeen() const { return seen_high > seen_low; }
  bool inside() const { return value >= low && value <= high; }
};

/// The round image: from the outermost columns and rows that are not black. A picture cut off above and below
/// (or at the sides) by the frame is a circle all the same; its radius is that of the longer extent.
/// @param bgr CV_8UC3; throws std::invalid_argument if it is empty, of another type, or all black
Circle findCircle(const cv::Mat& bgr);

/// Measures a picture inside the circle, against figures taken from eight frames of real laparoscopic
/// cholecystectomies (CholecSeg8k; vest_viz/docs/pictures.md lists them and how each is computed here).
///
/// Luminance is 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601), 0 … 255. The outer 4 % of the radius, where rim
/// and soft edge are, count in no row but the last.
std::vector<Row> checkPicture(const cv::Mat& bgr, const Circle& circle);

bool allInside(const std::vector<Row>& rows);

/// The table as text, one row a line: value, range, yes or NO; after it what the eight frames show where that
/// is narrower, with "below" or "above" if the value lies outside of it.
std::string format(const std::vector<Row>& rows);

}  // namespace vest::picture

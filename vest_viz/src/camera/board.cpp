#include "vest_viz/camera/board.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace vest::camera {

void checkSize(const cv::Mat& picture, const cv::Mat& first) {
  // As readCalibration() takes them. The search for corners takes 80 bytes a pixel, and minutes for 64
  // megapixels.
  if (std::min(picture.cols, picture.rows) < 64 || std::max(picture.cols, picture.rows) > 4096)
    throw std::runtime_error("a picture of " + std::to_string(picture.cols) + " x " +
                             std::to_string(picture.rows) + " pixels; allowed: 64 to 4096 each way");
  if (picture.size() != first.size())
    throw std::runtime_error("a picture of another size than the first; allowed: pictures of one size");
}

BoardCalibration calibrate(const std::vector<cv::Mat>& pictures, const Board& board) {
  const cv::Size inner(board.columns - 1, board.rows - 1);
  std::vector<cv::Point3f> points;
  for (int r = 0; r < inner.height; ++r)
    for (int c = 0; c < inner.width; ++c)
      points.emplace_back(static_cast<float>(c * board.square), static_cast<float>(r * board.square), 0.0f);
  BoardCalibration out;
  for (const cv::Mat& picture : pictures) {
    checkSize(picture, pictures.front());
    cv::Mat grey = picture;
    if (picture.channels() == 3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    std::vector<cv::Point2f> found;
    out.found.push_back(cv::findChessboardCornersSB(grey, inner, found, cv::CALIB_CB_ACCURACY));
    if (out.found.back()) out.corners.push_back(found);
  }
  if (out.corners.size() < 3)
    throw std::runtime_error(
        "the board was found in " + std::to_string(out.corners.size()) + " of " +
        std::to_string(pictures.size()) +
        " pictures; allowed: three or more, with all of its inner corners in the picture");
  const std::vector<std::vector<cv::Point3f>> where(out.corners.size(), points);
  cv::Mat K, D;
  std::vector<cv::Mat> R, t;
  out.error = cv::calibrateCamera(where, out.corners, pictures.front().size(), K, D, R, t,
                                  cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3);
  out.camera.width = static_cast<std::uint32_t>(pictures.front().cols);
  out.camera.height = static_cast<std::uint32_t>(pictures.front().rows);
  out.camera.fx = K.at<double>(0, 0), out.camera.fy = K.at<double>(1, 1);
  out.camera.cx = K.at<double>(0, 2), out.camera.cy = K.at<double>(1, 2);
  out.camera.distortion = {D.at<double>(0), D.at<double>(1), 0, 0, 0};
  return out;
}

std::string toYaml(const Intrinsics& c, const std::string& name) {
  const auto& d = c.distortion;
  char text[1200];
  std::snprintf(text, sizeof text,
                "image_width: %u\nimage_height: %u\ncamera_name: %s\n"
                "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [%.9g, 0, %.9g, 0, %.9g, %.9g, 0, 0, 1]\n"
                "distortion_model: %s\ndistortion_coefficients:\n  rows: 1\n  cols: %d\n  data: [%.9g, %.9g, "
                "%.9g, %.9g",
                c.width, c.height, name.c_str(), c.fx, c.cx, c.fy, c.cy,
                c.model == Distortion::PlumbBob ? "plumb_bob" : "equidistant",
                c.model == Distortion::PlumbBob ? 5 : 4, d[0], d[1], d[2], d[3]);
  std::string out = text;
  if (c.model == Distortion::PlumbBob) {
    std::snprintf(text, sizeof text, ", %.9g", d[4]);
    out += text;
  }
  std::snprintf(
      text, sizeof text,
      "]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [%.9g, 0, %.9g, 0, 0, %.9g, %.9g, 0, 0, 0, 1, 0]\n",
      c.fx, c.cx, c.fy, c.cy);
  return out + text;
}

}  // namespace vest::camera

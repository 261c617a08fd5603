#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vest_viz/camera/model.h"

namespace vest::camera {

/// A chessboard; its inner corners are one fewer than its squares, both ways.
struct Board {
  int columns = 10, rows = 8;  ///< squares, 4 or more
  double square = 0.0055;      ///< m, edge
};

struct BoardCalibration {
  Intrinsics camera;        ///< plumb_bob with k1 and k2: rod lenses are round
  double error = 0;         ///< pixels, root mean square between corners and where the camera has them
  std::vector<bool> found;  ///< of each picture: the board was found
  std::vector<std::vector<cv::Point2f>> corners;  ///< pixels, of the pictures in which it was found
};

/// @param first the first picture of them
/// @throws std::runtime_error where calibrate() takes no picture of this size
void checkSize(const cv::Mat& picture, const cv::Mat& first);

/// The camera from pictures of a board (OpenCV: findChessboardCornersSB, and calibrateCamera, which follows
/// Zhang, "A flexible new technique for camera calibration", IEEE TPAMI 2000).
/// @param pictures grey or colour, all of one size; the board in three or more of them
/// @throws std::runtime_error with what is wrong and what is allowed
BoardCalibration calibrate(const std::vector<cv::Mat>& pictures, const Board& board);

/// A calibration file as camera_calibration writes it; readCalibration() reads the same camera.
std::string toYaml(const Intrinsics& camera, const std::string& name);

}  // namespace vest::camera

/// Pictures from files that anybody may have written.
#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace vest::picture {

/// Reads a PNG or JPEG file of at most 64 MiB. Not beside other threads: what the codecs print of their own
/// goes nowhere meanwhile.
/// @param mode cv::ImreadModes @param most megapixels (2^20), at most 64
/// @throws std::runtime_error "FILE: cause: what is allowed"
cv::Mat read(const std::string& path, int mode, int most = 64);

}  // namespace vest::picture

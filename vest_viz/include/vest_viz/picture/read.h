/// Pictures from files that anybody may have written.
#pragma once

#include <string>

#include <opencv2/core.hpp>

namespace vest::picture {

/// Reads a PNG or JPEG file of at most 64 MiB and 64 megapixels. Not beside other threads: what the codecs
/// print of their own goes nowhere meanwhile.
/// @param mode cv::ImreadModes
/// @throws std::runtime_error "FILE: cause: what is allowed"
cv::Mat read(const std::string& path, int mode);

}  // namespace vest::picture

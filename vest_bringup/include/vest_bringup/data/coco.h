#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace vest::data {

/// Lengths of runs of other pixels and of pixels with a label, in turn, column by column: COCO's uncompressed
/// run-length encoding (https://cocodataset.org/#format-data). @param labels CV_16U
std::vector<std::uint32_t> runs(const cv::Mat& labels, std::uint16_t label);

/// Makes FOLDER/annotations.json of what `vest_render --truth` wrote there: a mask with bounding box and area
/// for each label of each picture, keypoints for each instrument. Depth becomes 16 bit PNG, 0.1 mm a level,
/// 0: nothing seen.
/// @param objects names by label  @param times s, of each picture  @param licence free text
/// @throws std::runtime_error naming a file that is not there or cannot be written
void writeCoco(const std::string& folder, const std::map<std::uint16_t, std::string>& objects,
               const std::vector<double>& times, const std::string& licence);

}  // namespace vest::data

#include "vest_bringup/data/coco.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vest::data {
namespace {

using nlohmann::json;

/// Labels beside those of the objects: vest_viz/README.md.
const std::map<std::uint16_t, std::string> kOthers{{60001, "left"},  {60002, "right"},  {60003, "third"},
                                                   {61001, "metal"}, {61002, "thread"}, {62001, "fluid"}};
constexpr std::array<const char*, 5> kPoints{"tip", "wrist", "jaw_left", "jaw_right", "entry"};

std::string path(const std::string& folder, const char* what, std::size_t frame, const char* end) {
  char name[64];
  std::snprintf(name, sizeof name, "/%s_%06zu.%s", what, frame, end);
  return folder + name;
}

cv::Mat read(const std::string& file) {
  cv::Mat picture = cv::imread(file, cv::IMREAD_UNCHANGED);
  if (picture.empty()) throw std::runtime_error(file + ": cannot be read");
  return picture;
}

void shortenDepth(const std::string& folder, std::size_t frame) {
  const std::string from = path(folder, "depth", frame, "tiff");
  const cv::Mat metres = read(from);
  cv::Mat levels(metres.size(), CV_16U);
  for (int y = 0; y < metres.rows; ++y)
    for (int x = 0; x < metres.cols; ++x) {
      const float d = metres.at<float>(y, x);
      levels.at<std::uint16_t>(y, x) =
          d > 0 && d < 6.5f ? static_cast<std::uint16_t>(std::lround(d * 10000)) : std::uint16_t{0};
    }
  const std::string to = path(folder, "depth", frame, "png");
  if (!cv::imwrite(to, levels)) throw std::runtime_error(to + ": cannot be written (is the disk full?)");
  std::filesystem::remove(from);
}

using Points = std::map<std::string, std::array<double, 3 * kPoints.size()>>;

/// Keypoints of each frame and instrument, in COCO's order: u, v, visibility.
std::map<std::size_t, Points> readKeypoints(const std::string& file) {
  std::ifstream in(file);
  std::string line, cell;
  if (!std::getline(in, line)) throw std::runtime_error(file + ": cannot be read");
  std::map<std::size_t, Points> all;
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::vector<std::string> c;
    while (std::getline(cells, cell, ',')) c.push_back(cell);
    if (c.size() != 8) throw std::runtime_error(file + ": a row of " + std::to_string(c.size()) + " cells");
    auto& points = all[std::stoul(c[0])].try_emplace(c[2]).first->second;
    for (std::size_t k = 0; k < kPoints.size(); ++k) {
      if (c[3] != kPoints[k] || c[7] == "0") continue;  // outside of the picture: zeros, as COCO has it
      points[3 * k] = std::stod(c[4]), points[3 * k + 1] = std::stod(c[5]),
                 points[3 * k + 2] = std::stod(c[7]);
    }
  }
  return all;
}

/// Area (pixels) and bounding box (x, y, width, height) of a label; area 0: it is not there.
std::pair<int, cv::Rect> extent(const cv::Mat& labels, std::uint16_t label) {
  const cv::Mat there = labels == label;
  return {cv::countNonZero(there), cv::boundingRect(there)};
}

json annotation(const cv::Mat& labels, std::uint16_t label, std::size_t image, std::size_t id) {
  const auto [area, box] = extent(labels, label);
  return {{"id", id},
          {"image_id", image},
          {"category_id", label},
          {"iscrowd", 1},  // COCO's mark of a run-length encoded mask
          {"area", area},
          {"bbox", {box.x, box.y, box.width, box.height}},
          {"segmentation", {{"size", {labels.rows, labels.cols}}, {"counts", runs(labels, label)}}}};
}

json categories(const std::map<std::uint16_t, std::string>& objects) {
  json all = json::array();
  for (const auto& [label, name] : objects)
    all.push_back({{"id", label}, {"name", name}, {"supercategory", "tissue"}});
  for (const auto& [label, name] : kOthers) {
    const bool instrument = label < 61001;
    json category{{"id", label}, {"name", name}, {"supercategory", instrument ? "instrument" : "other"}};
    if (instrument) category["keypoints"] = kPoints, category["skeleton"] = {{2, 1}, {2, 3}, {2, 4}, {2, 5}};
    all.push_back(category);
  }
  return all;
}

}  // namespace

std::vector<std::uint32_t> runs(const cv::Mat& labels, std::uint16_t label) {
  std::vector<std::uint32_t> counts{0};
  bool inside = false;
  for (int x = 0; x < labels.cols; ++x)
    for (int y = 0; y < labels.rows; ++y) {
      if ((labels.at<std::uint16_t>(y, x) == label) != inside) counts.push_back(0), inside = !inside;
      ++counts.back();
    }
  return counts;
}

void writeCoco(const std::string& folder, const std::map<std::uint16_t, std::string>& objects,
               const std::vector<double>& times, const std::string& licence) {
  json images = json::array(), annotations = json::array();
  const auto keypoints = readKeypoints(folder + "/keypoints.csv");
  for (std::size_t frame = 0; frame < times.size(); ++frame) {
    const cv::Mat labels = read(path(folder, "segmentation", frame, "png"));
    if (labels.type() != CV_16U) throw std::runtime_error(folder + ": labels are not of 16 bit");
    shortenDepth(folder, frame);
    images.push_back({{"id", frame},
                      {"file_name", path("", "frame", frame, "png").substr(1)},
                      {"depth_file_name", path("", "depth", frame, "png").substr(1)},
                      {"flow_file_name", path("", "flow", frame, "flo").substr(1)},
                      {"width", labels.cols},
                      {"height", labels.rows},
                      {"license", 1},
                      {"time_s", times[frame]}});
    std::set<std::uint16_t> there;
    for (int y = 0; y < labels.rows; ++y)
      there.insert(labels.ptr<std::uint16_t>(y), labels.ptr<std::uint16_t>(y) + labels.cols);
    there.erase(0);
    const auto points = keypoints.find(frame);
    for (const std::uint16_t label : there) {
      json a = annotation(labels, label, frame, annotations.size() + 1);
      const auto other = kOthers.find(label);
      if (other != kOthers.end() && points != keypoints.end() && points->second.count(other->second) > 0) {
        const auto& k = points->second.at(other->second);
        int seen = 0;
        for (std::size_t i = 2; i < k.size(); i += 3) seen += k[i] > 0 ? 1 : 0;
        a["keypoints"] = k, a["num_keypoints"] = seen;
      }
      annotations.push_back(std::move(a));
    }
  }
  const json all{{"info", {{"description", "VEST: rendered endoscopic pictures with ground truth"}}},
                 {"licenses", {{{"id", 1}, {"name", licence}, {"url", ""}}}},
                 {"images", images},
                 {"annotations", annotations},
                 {"categories", categories(objects)}};
  const std::string file = folder + "/annotations.json";
  std::ofstream out(file);
  out << all.dump() << "\n";
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written (is the disk full?)");
}

}  // namespace vest::data

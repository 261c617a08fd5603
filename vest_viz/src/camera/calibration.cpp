#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "vest_instruments/files/strict_yaml.h"
#include "vest_viz/camera/model.h"

namespace vest::camera {
namespace {

template <class T>
T read(const YAML::Node& root, const std::string& path, const char* field, const char* sub,
       const char* allowed) {
  const YAML::Node outer = root[field];
  const YAML::Node node = sub != nullptr && outer && outer.IsMap() ? outer[sub] : outer;
  const std::string name = std::string(field) + (sub != nullptr ? std::string(".") + sub : "");
  try {
    if (node) return node.as<T>();
  } catch (const YAML::Exception&) {
    throw std::runtime_error(path + ": " + name + " cannot be read (allowed: " + allowed + ")");
  }
  throw std::runtime_error(path + ": " + name + " is missing (allowed: " + allowed + ")");
}

/// `field`.data. Its rows and cols, which ROS's files have beside it, must say as many numbers.
std::vector<double> matrix(const YAML::Node& root, const std::string& path, const char* field,
                           const char* allowed) {
  const auto data = read<std::vector<double>>(root, path, field, "data", allowed);
  double said = 1;
  for (const char* side : {"rows", "cols"})
    said *= root[field][side] ? read<double>(root, path, field, side, "a whole number") : std::nan("");
  if (!std::isnan(said) && said != static_cast<double>(data.size()))
    throw std::runtime_error(path + ": " + field + ".data: " + std::to_string(data.size()) +
                             " numbers (allowed: as many as its rows and cols say)");
  return data;
}

/// Of two that have one name, only one would be read.
void refuseTwice(const YAML::Node& map, const std::string& path, const std::string& of) {
  std::set<std::string> names;
  for (const auto& entry : map) {
    if (!entry.first.IsScalar())
      throw std::runtime_error(path + ": " + of + "a name that is none (allowed: text)");
    const std::string name = files::shown(entry.first.Scalar());
    if (!names.insert(entry.first.Scalar()).second)
      throw std::runtime_error(path + ": " + of + name + " stands there twice (allowed: once)");
    if (entry.second.IsMap()) refuseTwice(entry.second, path, of + name + ".");
  }
}

}  // namespace

Intrinsics readCalibration(const std::string& path) {
  YAML::Node root;
  try {
    root = files::parseYaml(files::read(path, 1 << 20));
  } catch (const files::Refused& e) {
    throw std::runtime_error(path + (e.line > 0 ? " line " + std::to_string(e.line) : "") + ": " + e.what());
  }
  if (!root.IsMap()) throw std::runtime_error(path + ": not a calibration file");
  refuseTwice(root, path, "");
  Intrinsics c;
  const auto width = read<int>(root, path, "image_width", nullptr, "64 … 4096 pixels");
  const auto height = read<int>(root, path, "image_height", nullptr, "64 … 4096 pixels");
  if (width < 64 || width > 4096 || height < 64 || height > 4096)
    throw std::runtime_error(path + ": image_width, image_height: " + std::to_string(width) + ", " +
                             std::to_string(height) + " (allowed: 64 … 4096 pixels)");
  c.width = static_cast<std::uint32_t>(width);
  c.height = static_cast<std::uint32_t>(height);
  const auto K = matrix(root, path, "camera_matrix", "nine numbers, row-major");
  const bool sound = K.size() == 9 &&
                     std::all_of(K.begin(), K.end(), [](double v) { return std::isfinite(v); }) &&
                     K[0] > 0.1 * width && K[0] < 20 * width && K[4] > 0.1 * height && K[4] < 20 * height &&
                     K[1] == 0 && K[3] == 0 && K[6] == 0 && K[7] == 0 && K[8] == 1 && K[2] >= 0 &&
                     K[2] < width && K[5] >= 0 && K[5] < height;
  if (!sound)
    throw std::runtime_error(path +
                             ": camera_matrix.data (allowed: [fx 0 cx 0 fy cy 0 0 1], focal lengths 0.1 … 20 "
                             "times the picture's size, no skew, principal point in the picture)");
  c.fx = K[0], c.cx = K[2], c.fy = K[4], c.cy = K[5];
  const auto model = read<std::string>(root, path, "distortion_model", nullptr, "plumb_bob, equidistant");
  if (model != "plumb_bob" && model != "equidistant")
    throw std::runtime_error(path + ": distortion_model: " + files::shown(model) +
                             " (allowed: plumb_bob, equidistant)");
  c.model = model == "plumb_bob" ? Distortion::PlumbBob : Distortion::Equidistant;
  const auto D = matrix(root, path, "distortion_coefficients", "4 or 5 numbers");
  const std::size_t most = c.model == Distortion::PlumbBob ? 5 : 4;
  if (D.size() < 4 || D.size() > most ||
      !std::all_of(D.begin(), D.end(), [](double v) { return std::isfinite(v) && std::fabs(v) < 10; }))
    throw std::runtime_error(path +
                             ": distortion_coefficients.data (allowed: 4 or 5 numbers of plumb_bob, 4 of "
                             "equidistant, below 10)");
  std::copy(D.begin(), D.end(), c.distortion.begin());
  return c;
}

}  // namespace vest::camera

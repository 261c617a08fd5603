#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vest_instruments/files/read.h"
#include "vest_tissue/image/patient.h"

namespace vest::image {

std::map<std::uint16_t, std::size_t> countLabels(const Volume& volume) {
  std::vector<std::size_t> counts(65536);
  for (std::size_t v = 0; v < volume.voxels(); ++v) {
    const double value = volume.value(v);
    if (!(value >= 0 && value <= 65535 && value == std::floor(value)))
      throw std::invalid_argument(volume.slices.front().file +
                                  ": is no label map: every value must be a whole number of 0 … 65535");
    ++counts[static_cast<std::size_t>(value)];
  }
  std::map<std::uint16_t, std::size_t> found;
  for (std::size_t label = 1; label < counts.size(); ++label)
    if (counts[label] > 0) found[static_cast<std::uint16_t>(label)] = counts[label];
  if (found.empty()) throw std::invalid_argument(volume.slices.front().file + ": has no label but 0");
  if (found.size() > 100)
    throw std::invalid_argument(volume.slices.front().file + ": has more than 100 labels: is it an image?");
  return found;
}

namespace {

/// What a recipe names; a refusal begins with the recipe and its field.
Volume readNamed(const Patient& patient, const char* field, const std::string& path,
                 const ReadOptions& options) try {
  return read(path, options);
} catch (const std::invalid_argument& error) {
  throw std::invalid_argument(files::shown(patient.file, 4096) + ": " + field + ": " + error.what());
}

}  // namespace

Volume readSource(const Patient& patient) {
  if (patient.label_map.empty()) return readNamed(patient, "images", patient.images, patient.reading);
  // As it is: between labels there is nothing.
  Volume map = readNamed(patient, "labels", patient.label_map, {});
  countLabels(map);
  if (patient.images.empty()) return map;
  const Volume images = readNamed(patient, "images", patient.images, patient.reading);
  bool same = map.size == images.size;
  for (int corner = 0; corner < 8 && same; ++corner) {
    const Eigen::Vector3d at(corner % 2 * (map.size[0] - 1.0), corner / 2 % 2 * (map.size[1] - 1.0),
                             corner / 4 * (map.size[2] - 1.0));
    const Eigen::Vector3d apart = map.origin + map.axes * at - images.origin - images.axes * at;
    same = apart.norm() <= 0.5 * images.spacing().minCoeff();
  }
  if (!same)
    throw std::invalid_argument(patient.label_map + ": lies on another grid than " + patient.images +
                                ": export it with the size, place and axes of the images");
  return map;
}

}  // namespace vest::image

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "vest_instruments/files/read.h"
#include "vest_tissue/image/volume.h"

namespace {

using nlohmann::json;
using vest::image::Statistics;
using vest::image::Volume;

json list(const Eigen::Vector3d& v) {
  return {v[0], v[1], v[2]};
}

void put(json& to, const Statistics& s) {
  const bool any = s.count > 0;
  to["min"] = any ? json(s.min) : json(), to["max"] = any ? json(s.max) : json();
  to["mean"] = any ? json(s.mean) : json();
}

json toJson(const Volume& volume) {
  json all;
  all["modality"] = volume.modality;
  all["unit"] = volume.unit;
  all["photometric"] = volume.photometric;
  all["size"] = volume.size;
  all["spacing_m"] = list(volume.spacing());
  all["origin_m"] = list(volume.origin);
  const Eigen::Matrix3d d = volume.direction();
  all["direction"] = json::array();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) all["direction"].push_back(d(r, c));
  all["tilt_rad"] = volume.tilt();
  all["resampled"] = volume.resampled;
  all["notes"] = volume.notes;
  put(all, statistics(volume));
  all["slices"] = json::array();
  for (std::uint32_t k = 0; k < volume.size[2]; ++k) {
    json slice;
    slice["position_m"] = list(volume.slices[k].position);
    put(slice, statistics(volume, k));
    slice["crc32"] = checksum(volume, k);
    all["slices"].push_back(std::move(slice));
  }
  return all;
}

void print(const Volume& volume) {
  const Eigen::Vector3d spacing = 1e3 * volume.spacing(), origin = 1e3 * volume.origin;
  const Eigen::Matrix3d d = volume.direction();
  const char* const unit = volume.unit.empty() ? "" : " HU";
  std::printf("modality   %s\n", volume.modality.empty() ? "not known" : volume.modality.c_str());
  std::printf("size       %u x %u x %u\n", volume.size[0], volume.size[1], volume.size[2]);
  std::printf("spacing    %.6g %.6g %.6g mm\n", spacing[0], spacing[1], spacing[2]);
  std::printf("origin     %.6g %.6g %.6g mm\n", origin[0], origin[1], origin[2]);
  for (int r = 0; r < 3; ++r)
    std::printf("%-10s %9.6f %9.6f %9.6f\n", r == 0 ? "direction" : "", d(r, 0), d(r, 1), d(r, 2));
  const Statistics s = statistics(volume);
  if (s.count > 0)
    std::printf("values     %.6g … %.6g%s, mean %.6g\n", s.min, s.max, unit, s.mean);
  else
    std::printf("values     nothing but padding\n");
  if (s.count < volume.voxels()) std::printf("padding    %zu voxels\n", volume.voxels() - s.count);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A patient's images as one grid: what it is, values in it, a file of it.");
  app.require_subcommand(1);
  vest::image::ReadOptions options;
  std::string path, file;
  bool as_json = false;
  std::vector<double> places;
  CLI::App* const info = app.add_subcommand("info", "size, spacing, origin, direction and values");
  CLI::App* const probe = app.add_subcommand("probe", "values of the voxels nearest to places, one a line");
  CLI::App* const exports = app.add_subcommand("export", "one file for other programs");
  for (CLI::App* const command : {info, probe, exports}) {
    command->add_option("PATH", path, "folder or file of DICOM, or a file of NRRD, MetaImage or NIfTI")
        ->required();
    command->add_option("--series", options.series,
                        "which of several series: its number in the list, or its UID");
    command->add_flag("--resample", options.resample,
                      "interpolate what is uneven or tilted; gaps of two distances at most");
  }
  info->add_flag("--json", as_json, "one JSON object, with every slice");
  probe->add_option("PLACES", places, "X Y Z …: mm, DICOM's patient axes (left, posterior, superior)")
      ->required();
  exports->add_option("FILE", file, ".nrrd or .mha (MetaImage)")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    if (places.size() % 3 != 0)
      throw std::invalid_argument("probe: places are X Y Z …: a multiple of three numbers");
    const Volume volume = vest::image::read(path, options);
    for (const auto& note : volume.notes)
      std::fprintf(stderr, "vest_image: note: %s\n", vest::files::shown(note, 1000).c_str());
    if (info->parsed() && as_json)
      std::printf("%s\n", toJson(volume).dump(1, ' ', false, json::error_handler_t::replace).c_str());
    else if (info->parsed())
      print(volume);
    for (std::size_t i = 0; i < places.size(); i += 3) {
      const auto voxel = volume.nearest(1e-3 * Eigen::Vector3d(places[i], places[i + 1], places[i + 2]));
      if (voxel)
        std::printf("%.9g\n", volume.value(*voxel));
      else
        std::printf("outside\n");
    }
    if (exports->parsed()) vest::image::write(volume, file);
    if (std::fflush(stdout) != 0) throw std::runtime_error("standard output cannot be written");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_image: %s\n", vest::files::shown(error.what(), 2000).c_str());
    return 1;
  }
}

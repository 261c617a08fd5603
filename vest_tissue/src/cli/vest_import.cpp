#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "check_table.h"
#include "vest_instruments/files/refusal.h"
#include "vest_tissue/image/felt_scene.h"
#include "vest_tissue/image/patient.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/volume/stuffing.h"
#include "vest_tissue/voxel/volume.h"

namespace {

namespace fs = std::filesystem;
using namespace vest::image;

void begin(const std::string& images, const std::string& folder, const ReadOptions& options, bool labels) {
  const fs::path recipe = fs::path(folder) / "patient.yaml";
  if (fs::exists(recipe)) throw std::invalid_argument(recipe.string() + ": is there already");
  if (labels && (options.resample || !options.series.empty()))
    throw std::invalid_argument(
        "--labels: goes with neither --series nor --resample: labels are not interpolated");
  const Volume volume = read(images, options);
  for (const auto& note : volume.notes)
    std::fprintf(stderr, "vest_import: note: %s\n", vest::files::shown(note, 1000).c_str());
  if (labels) countLabels(volume);
  fs::create_directories(folder);
  const std::string name = fs::absolute(folder).lexically_normal().filename().string(),
                    source = fs::absolute(images).string();
  std::string text = labels ? firstOfLabels(name, source, volume) : firstPatient(name, source, volume);
  if (!options.series.empty()) text += "series: \"" + options.series + "\"\n";
  if (options.resample) text += "resample: true\n";
  std::ofstream out(recipe, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::invalid_argument(recipe.string() + ": cannot be written");
  try {
    readPatient(recipe.string());  // a name that a recipe cannot have is told now
  } catch (...) {
    fs::remove(recipe);
    throw;
  }
  std::printf("%s: %u x %u x %u voxels. Look at its labels, then: vest_import bake %s\n",
              vest::files::shown(recipe, 6000).c_str(), volume.size[0], volume.size[1], volume.size[2],
              vest::files::shown(folder, 6000).c_str());
}

int feel(const std::string& images, const std::string& folder, const ReadOptions& options,
         const std::string& table) {
  const Volume volume = read(images, options);
  for (const auto& note : volume.notes)
    std::fprintf(stderr, "vest_import: note: %s\n", vest::files::shown(note, 1000).c_str());
  const bool is_new = fs::create_directories(folder);
  vest::scene::Description scene;
  std::string path;
  try {
    path = writeFeltScene(volume, folder, table,
                          [&](const std::string& written) { scene = vest::scene::loadScene(written); });
  } catch (...) {
    std::error_code not_empty;
    if (is_new) fs::remove(folder, not_empty);
    throw;
  }
  for (const auto& note : scene.feel->notes) std::fprintf(stderr, "vest_import: note: %s\n", note.c_str());
  std::printf(
      "%s: voxels of %.2f mm, smoothed over %.2f mm; the yield changes by at most %.1f %% a millisecond\n",
      vest::files::shown(path, 6000).c_str(), 1e3 * scene.feel->spacing, 1e3 * scene.feel->smoothing,
      100 * scene.feel->steepest);
  return 0;
}

int bake(const std::string& folder) {
  const Patient patient = readPatient((fs::path(folder) / "patient.yaml").string());
  const Volume volume = readSource(patient);
  if (!patient.label_map.empty())
    for (const auto& [label, voxels] : countLabels(volume)) {
      const auto named = [label = label](const Segment& s) { return s.low == label; };
      if (std::none_of(patient.segments.begin(), patient.segments.end(), named))
        std::fprintf(stderr, "vest_import: note: label %u has no tissue: %zu voxels are left out\n", label,
                     voxels);
    }
  const auto labels = segment(volume, patient);
  const auto lattice = mesh(labels, patient);
  const auto volumes = volumesOf(labels, lattice, patient.segments.size());
  for (std::size_t s = 0; s < volumes.size(); ++s)
    std::printf("%-16s %9.1f ml of voxels, %9.1f ml of elements%s\n", patient.segments[s].name.c_str(),
                1e6 * volumes[s].voxels, 1e6 * volumes[s].elements,
                volumes[s].elements < 0.9 * volumes[s].voxels ? ": parts are thin for this cell" : "");
  const auto [least, greatest] = vest::volume::dihedralAngles(lattice);
  std::printf("%zu nodes, %zu tetrahedra, dihedral angles %.1f … %.1f degrees\n", lattice.nodes.size(),
              lattice.tetrahedra.size(), least, greatest);
  vest::scene::Description scene;
  writePatientScene(lattice, patient, folder,
                    [&](const std::string& written) { scene = vest::scene::loadScene(written); });
  const std::string fault = vest::tools::printCheck(scene);
  return vest::tools::printVerdict({lossSentence(volumes, patient), fault, vest::tools::startFault(scene)})
             ? 0
             : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("A scene from a patient's images (docs/images.md).");
  app.require_subcommand(1);
  ReadOptions options;
  std::string images, folder;
  bool of_labels = false;
  CLI::App* const first = app.add_subcommand("new", "a recipe to begin with: FOLDER/patient.yaml");
  first->add_option("IMAGES", images, "folder or file of DICOM, or a file of NRRD, MetaImage or NIfTI")
      ->required();
  first->add_option("FOLDER", folder, "of the patient; its name becomes that of the scene")->required();
  first->add_option("--series", options.series,
                    "which of several series: its number in the list, or its UID");
  first->add_flag("--labels", of_labels, "IMAGES is a ready label map");
  first->add_flag("--resample", options.resample, "interpolate what is uneven or tilted");
  CLI::App* const second =
      app.add_subcommand("bake", "labels, mesh and a scene that runs, beside the recipe");
  second->add_option("FOLDER", folder, "with patient.yaml")->required();
  CLI::App* const third = app.add_subcommand("feel", "a scene in which a needle and a probe feel the images");
  std::string table;
  third->add_option("IMAGES", images, "folder or file of DICOM, or a file of NRRD, MetaImage or NIfTI")
      ->required();
  third->add_option("FOLDER", folder, "of the scene, which gets its name")->required();
  third->add_option("--series", options.series,
                    "which of several series: its number in the list, or its UID");
  third->add_flag("--resample", options.resample, "interpolate what is uneven or tilted");
  third->add_option("--table", table,
                    "CSV of colours and forces by value (docs/images.md); else the shipped one, for HU");
  CLI11_PARSE(app, argc, argv);
  try {
    if (third->parsed()) return feel(images, folder, options, table);
    if (second->parsed()) return bake(folder);
    begin(images, folder, options, of_labels);
    return 0;
  } catch (const std::exception& error) {
    const std::string recipe = second->parsed() ? (fs::path(folder) / "patient.yaml").string() : "";
    std::fprintf(stderr, "vest_import: %s\n",
                 recipe.empty() ? vest::files::shown(error.what(), 2000).c_str()
                                : vest::files::refusal(error.what(), recipe).c_str());
    return 1;
  }
}

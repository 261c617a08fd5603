#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>

#include "apart.h"
#include "readers.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/image/patient.h"
#include "vest_tissue/image/phantom.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/material/sutures.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/library.h"
#include "vest_tissue/modelling/session.h"
#include "vest_tissue/modelling/source.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/rod_scene.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/suture/rod.h"
#include "vest_tissue/volume/lattice.h"
#include "vest_tissue/volume/mesh_file.h"
#include "vest_tissue/volume/transfer_table.h"

namespace vest::fuzz {

void step(scene::World& world, int count) {
  scene::StepInput input;
  scene::StepReport report;
  input.dt = world.description().dt;
  for (int i = 0; i < count; ++i) {
    input.step = world.steps();
    world.step(input, report);
  }
}

namespace {

/// A scene and its side files; a small one that is taken makes its first steps.
void readScene(const std::string& input) {
  const std::string file = folder().unpack("scene.yaml", input);
  scene::Description d;
  if (!takes(folder().path(), [&] { d = scene::loadScene(file); })) return;
  std::size_t knots = 0;
  for (const auto& object : d.objects) knots += object.position.size();
  if (knots > 400 || d.integrator != scene::Integrator::NewtonEuler) return;
  d.cache_directory.clear();
  takes("", [&] {
    scene::World world(d);
    step(world, 3);
  });
}

void readSurface(const std::string& input) {
  if (input.empty()) return;
  const char* const names[] = {"a.obj", "a.stl", "a.ply"};  // the first byte says which
  const std::string name = names[static_cast<unsigned char>(input[0]) % 3];
  volume::Surface surface;
  if (!takes(name, [&] { surface = volume::readSurface(name, input.substr(1)); })) return;
  takes("", [&] {
    double extent = 0;
    for (const auto& v : surface.vertices) extent = std::max(extent, (v - surface.vertices[0]).norm());
    volume::Lattice lattice = volume::fillSurface(surface, std::max(extent / 8, 1e-6));
    volume::fitBoundary(lattice, surface, std::max(extent / 8, 1e-6));
    volume::embed(lattice, surface);
  });
}

void readMesh(const std::string& input) {
  if (input.empty()) return;
  const std::string name = input[0] % 2 == 0 ? "a.msh" : "a.vtk";
  takes(name, [&] { volume::readTetrahedra(name, input.substr(1)); });
}

void readNet(const std::string& input) {
  scene::Object object;
  takes("a.net", [&] {
    scene::decodeBaked(input, "a.net", object);
    scene::checkObject(object, "a.net");
  });
}

const modelling::Materials& shippedMaterials() {
  static const auto materials =
      modelling::readMaterials(std::string(VEST_SOURCE_DIR) + "/vest_tissue/data/materials.yaml");
  return materials;
}

void readSource(const std::string& input) {
  const std::string file = folder().unpack("source.yaml", input);
  modelling::SceneSource source;
  if (!takes(file, [&] { source = modelling::readSource(file); })) return;
  std::size_t work = 0;
  for (const auto& o : source.objects) {
    if (o.tube) work += o.tube->rings * o.tube->around;
    if (o.sheet) work += o.sheet->stations * o.sheet->height_knots * 2;
    if (o.revolve) work += o.revolve->rings * o.revolve->around;
    for (const auto& layer : o.layers) work += 10 * layer.elements;
  }
  if (work > 400) return;
  takes("", [&] { modelling::bake(source, shippedMaterials()); });
}

/// Edits of a small source; those that are taken are undone to the same bytes.
void readEdits(const std::string& input) {
  const std::string start =
      "vest_source: 1\nname: a\nobjects:\n  - name: a  # one\n    organ: tube\n    material: tube\n    tube: "
      "{centre: [[0, 0, 0.05], [0.02, 0, 0.05]], reference: [0, 0, 1], rings: 4, around: 4, sections: [{at: "
      "0, "
      "radii: [0.002]}]}\n    fixed: [{rings: [0, 0]}]\n";
  modelling::Session session("source.yaml", start, shippedMaterials());
  takes("edits.yaml", [&] { modelling::play(modelling::readEdits("edits.yaml", input), session); });
  while (session.canUndo()) session.apply("undo", "");
  if (session.text() != start) std::abort();
}

/// index.yaml in a package of two files.
void readLibrary(const std::string& input) {
  static const Folder package;
  static const std::string index = [] {
    std::filesystem::create_directory(package.path() + "/library");
    for (const char* const name : {"/library/tube.yaml", "/materials.yaml"})
      std::ofstream(package.path() + name) << "vest_part: 1\n";
    return package.path() + "/library/index.yaml";
  }();
  std::filesystem::remove(index);
  std::ofstream(index, std::ios::binary) << input;
  takes(package.path(), [&] { modelling::readLibrary(index); });
}

void readMaterials(const std::string& input) {
  const std::string file = folder().unpack("materials.yaml", input);
  takes(file, [&] { material::readDatabase(file); });
}

/// All of them take 40 ms to read, and are no other kinds.
std::vector<std::string> materialFiles() {
  return {materialsOf({"fat_soft", "fat_firm"})};
}

void readSutures(const std::string& input) {
  const std::string file = folder().unpack("sutures.yaml", input);
  takes(file, [&] { material::readSutures(file); });
}

/// Rods with their tables; a short one that is taken makes its first steps.
void readRods(const std::string& input) {
  const std::string file = folder().unpack("scene.yaml", input);
  scene::RodScene read;
  if (!takes(folder().path(), [&] { read = scene::loadRods(file); })) return;
  std::size_t nodes = 0;
  for (const auto& rod : read.objects.rods) nodes += rod.nodes.size();
  if (nodes > 200) return;
  takes("", [&] {
    const suture::Model model(read.objects);
    suture::State state = model.start;
    suture::Scratch scratch(model);
    for (int i = 0; i < 3; ++i) suture::step(model, state, scratch, read.dt);
  });
}

void readPatient(const std::string& input) {
  const std::string file = folder().unpack("patient.yaml", input);
  const FewMaterials few;
  takes(file, [&] { image::readPatient(file); });
}

std::vector<std::string> patients() {
  const Folder one;
  image::PhantomImage options;
  options.size = {12, 10, 8};
  const auto volume = image::picture(image::makePhantom("head"), options);
  image::write(volume, one.path() + "/a.nrrd");
  return {image::firstPatient("head", "a.nrrd", volume, false),
          "vest_patient: 1\nname: knee\nlabels: a.nrrd\ntissues:\n  - {label: 1, name: bone, tissue: "
          "bone}\ncell: 4\n"
          "held: [bone]\ncrop: [[-5, -5, -5], [5, 5, 5]]\nplace: [0, 0.05, 0.03]\n"};
}

void readCurve(const std::string& input) {
  const std::string file = folder().unpack("curve.csv", input);
  std::vector<material::Point> points;
  if (takes(file, [&] { points = material::readCurve(file); }))
    takes("", [&] { material::fitLaw(points, 4); });
}

void readTable(const std::string& input) {
  const std::string file = folder().unpack("table.csv", input);
  volume::TransferTable table;
  if (takes(file, [&] { table = volume::readTransferTable(file); })) volume::transfer(table, 0);
}

std::vector<std::string> nets() {
  std::vector<std::string> made{
      files::read(std::string(VEST_SOURCE_DIR) + "/vest_tissue/scenes/tube/tube.net", 8 << 20)};
  const std::string scene = files::read(std::string(VEST_SOURCE_DIR) + "/fuzz/corpus/scene/two", 1 << 20);
  for (const auto& object : scene::loadScene(folder().unpack("scene.yaml", scene)).objects)
    if (!object.fem) made.push_back(scene::encodeBaked(object));
  return made;
}

void readDicom(const std::string& input) {
  folder().clear();
  const std::string file = folder().write("slice", input);
  takes(file, [&] { image::read(file); });
}

/// The first slice of a phantom in each of the ways that files are written.
std::vector<std::string> dicomFiles() {
  image::PhantomImage options;
  options.size = {12, 10, 8};
  const auto volume = image::picture(image::makePhantom("head"), options);
  std::vector<std::string> made;
  for (const char* const fault : {"none", "big_endian", "implicit", "padding", "rle", "jpeg", "jpeg_ls",
                                  "jpeg2000", "multi_frame", "multi_frame_jpeg2000", "colour"}) {
    const Folder of_series;
    image::writeDicom(volume, of_series.path(), fault);
    made.push_back(files::read(of_series.path() + "/I0001", 1 << 20));
  }
  return made;
}

void readVolume(const std::string& input) {
  if (input.empty()) return;
  const char* const names[] = {"a.nrrd", "a.mha", "a.nii"};  // the first byte says which
  folder().clear();
  const std::string file = folder().write(names[static_cast<unsigned char>(input[0]) % 3], input.substr(1));
  image::Volume volume;
  if (takes(file, [&] { volume = image::read(file); }))
    takes("", [&] { image::firstOfLabels("a", file, volume, false); });
}

std::vector<std::string> volumeFiles() {
  image::PhantomImage options;
  options.size = {12, 10, 8};
  const auto volume = image::picture(image::makePhantom("head"), options);
  std::vector<std::string> made;
  for (const char* const name : {"/0.nrrd", "/1.mha"}) {
    const Folder one;
    image::write(volume, one.path() + name);
    made.push_back(std::string(1, name[1]) + files::read(one.path() + name, 1 << 20));
  }
  return made;
}

std::function<void(const std::string&)> apart(void (*read)(const std::string&)) {
  return [runs = std::make_shared<Apart>(read)](const std::string& input) { (*runs)(input); };
}

}  // namespace

std::vector<Reader> tissueReaders() {
  return {{"scene", readScene, {}},
          {"surface", readSurface, {}},
          {"mesh", readMesh, {}},
          {"net", readNet, nets},
          {"source", readSource, {}},
          {"edits", readEdits, {}},
          {"library", readLibrary, {}},
          {"materials", readMaterials, materialFiles},
          {"sutures", readSutures, shipped("vest_tissue/data/sutures.yaml")},
          {"rods", readRods, {}},
          {"patient", readPatient, patients},
          {"curve", readCurve, {}},
          {"table", readTable,
           shipped("vest_tissue/library/tables/soft.csv", "vest_tissue/library/tables/bone.csv")},
          {"dicom", apart(readDicom), dicomFiles},
          {"volume", apart(readVolume), volumeFiles}};
}

}  // namespace vest::fuzz

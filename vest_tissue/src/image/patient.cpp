#include "vest_tissue/image/patient.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "vest_tissue/fem/tissue.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/image/brick.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/volume/stuffing.h"
#include "written_scene.h"

namespace vest::image {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using scene::yaml::Map;
using scene::yaml::Value;

Segment segmentOf(const Value& item, const material::Database& tissues, bool of_map) {
  Map map(item);
  Segment s;
  s.name = map["name"].name();
  s.tissue = map["tissue"].name();
  const auto known = [&](const material::Tissue& t) { return t.name == s.tissue; };
  if (std::none_of(tissues.tissues.begin(), tissues.tissues.end(), known))
    map["tissue"].fail("must be a material of the database (vest_material list)");
  if (of_map) {
    s.low = s.high = map["label"].integer(1, 65535);
  } else {
    const auto values = map["values"].list();
    if (values.size() != 2) map["values"].fail("must be two numbers: [least, greatest]");
    s.low = values[0].number(-1e30, 1e30), s.high = values[1].number(s.low, 1e30);
  }
  if (map.has("median")) s.median = map["median"].integer(0, 5);
  if (map.has("closing")) s.closing = map["closing"].integer(0, 20);
  if (map.has("from")) s.grows = true, s.from = 1e-3 * map["from"].vector3();
  if (map.has("largest")) s.largest = map["largest"].integer(1, 1000);
  map.finish();
  return s;
}

template <class... Numbers>
std::string print(const char* format, Numbers... numbers) {
  char text[256];
  std::snprintf(text, sizeof text, format, numbers...);
  return text;
}

/// Legacy VTK with a label for each cell. Coordinates as they are, to the last bit.
std::string toVtk(const volume::Lattice& lattice, const std::string& name) {
  std::string text = "# vtk DataFile Version 3.0\n" + name + ", m\nASCII\nDATASET UNSTRUCTURED_GRID\n" +
                     print("POINTS %zu double\n", lattice.nodes.size());
  for (const Vector3d& n : lattice.nodes) text += print("%.17g %.17g %.17g\n", n[0], n[1], n[2]);
  const std::size_t count = lattice.tetrahedra.size();
  text += print("CELLS %zu %zu\n", count, 5 * count);
  for (const auto& t : lattice.tetrahedra) text += print("4 %u %u %u %u\n", t[0], t[1], t[2], t[3]);
  text += print("CELL_TYPES %zu\n", count);
  for (std::size_t i = 0; i < count; ++i) text += "10\n";
  text += print("CELL_DATA %zu\nSCALARS label int 1\nLOOKUP_TABLE default\n", count);
  for (const auto label : lattice.label) text += print("%u\n", label);
  return text;
}

/// Nodes that do not move, in ascending order.
std::set<volume::Index> heldNodes(const volume::Lattice& lattice, const Patient& patient) {
  std::set<volume::Index> held;
  for (std::size_t s = 0; s < patient.segments.size(); ++s) {
    if (std::find(patient.held.begin(), patient.held.end(), patient.segments[s].name) == patient.held.end())
      continue;
    for (std::size_t t = 0; t < lattice.label.size(); ++t)
      if (lattice.label[t] == s + 1) held.insert(lattice.tetrahedra[t].begin(), lattice.tetrahedra[t].end());
  }
  if (!patient.held.empty()) return held;
  double low = 1e300, high = -1e300;
  for (const Vector3d& n : lattice.nodes) low = std::min(low, n[2]), high = std::max(high, n[2]);
  for (volume::Index n = 0; n < lattice.nodes.size(); ++n)
    if (lattice.nodes[n][2] <= low + 0.1 * (high - low)) held.insert(n);
  return held;
}

/// A text of YAML: a path may have colons and hashes.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += std::string(c == '"' || c == '\\' ? "\\" : "") + c;
  return out + "\"";
}

constexpr double kMostPlace = 100;  // m (assumed): the box is half a metre wide
const char* const kFirstPlace = "place: [0, 0.05, 0.03]     # m, world: the middle of the underside\n";

constexpr double kLeastKept = 0.5;  // of a label's volume (tuned): a shape that lost more is another one
// Assumed: whoever asks for a recipe does not wait for long.
constexpr std::size_t kMostLooked = std::size_t{1} << 28;  // voxels times labels
constexpr int kMostCells = 8;                              // that are tried

bool keepsHalf(const LabelVolume& v) {
  return v.elements >= kLeastKept * v.voxels;
}

/// The largest cell at which all labels keep their shape, of a twentieth of the volume and those that are a
/// fifth smaller each time; else the smallest of which a scene has the nodes.
double cellOf(const Volume& volume, Patient patient, bool fitting) {
  const Vector3d extent = volume.axes.cwiseAbs() * Vector3d(volume.size[0], volume.size[1], volume.size[2]);
  double cell = std::ceil(1e3 * extent.maxCoeff() / 20);
  if (!fitting || volume.voxels() * patient.segments.size() > kMostLooked) return cell;
  // Whoever bakes is told of a label without voxels, and of more cubes than are made.
  try {
    const auto labels = segment(volume, patient);
    bool made = false;
    double next = cell;
    for (int i = 0; i < kMostCells && next >= 0.1; ++i, next = 0.1 * std::floor(8 * next)) try {
        patient.cell = 1e-3 * next;
        const auto lattice = mesh(labels, patient);
        if (lattice.nodes.size() > fem::kMostTissueNodes) break;
        made = true, cell = next;
        const auto volumes = volumesOf(labels, lattice, patient.segments.size());
        if (std::all_of(volumes.begin(), volumes.end(), keepsHalf)) break;
      } catch (const std::invalid_argument&) {
        if (made) break;  // else all of it is thinner than such a cell
      }
  } catch (const std::invalid_argument&) {
  }
  return cell;
}

std::string firstCell(const Volume& volume, const Patient& patient, bool fitting) {
  return print("cell: %-4g                 # mm: smaller cells, finer mesh\n",
               cellOf(volume, patient, fitting));
}

}  // namespace

Patient readPatient(const std::string& path) {
  const Value root = scene::yaml::parse(path, scene::yaml::readFile(path, scene::yaml::kMaxBytes));
  Map map(root);
  Patient p;
  p.file = path;
  map["vest_patient"].integer(1, 1);
  p.name = map["name"].name();
  if (p.name == "patient") map["name"].fail("must be another: patient.yaml is this recipe");
  const auto place = [&](const Value& v) { return (fs::path(path).parent_path() / v.string()).string(); };
  const bool of_map = map["labels"].isScalar();
  if (of_map) p.label_map = place(map["labels"]);  // an absolute one stays
  if (!of_map || map.has("images")) p.images = place(map["images"]);
  if (map.has("series")) p.reading.series = map["series"].string();
  if (map.has("resample")) p.reading.resample = map["resample"].boolean();
  for (const char* const key : {"series", "resample"})
    if (p.images.empty() && map.has(key)) map[key].fail("belongs to images, which are not given");
  if (map.has("crop")) {
    const auto corners = map["crop"].list();
    if (corners.size() != 2) map["crop"].fail("must be two corners in mm: [[x, y, z], [x, y, z]]");
    p.cropped = true;
    p.low = 1e-3 * corners[0].vector3(), p.high = 1e-3 * corners[1].vector3();
    if (!(p.low.array() < p.high.array()).all())
      map["crop"].fail("must be the lower corner, then the upper one: nothing lies between these");
  }
  const auto tissues = material::readDatabase(material::databasePath());
  const char* const list = of_map ? "tissues" : "labels";
  const auto entries = map[list].list();
  if (entries.empty() || entries.size() > 100) map[list].fail("must have 1 … 100 entries");
  std::set<std::string> names;
  std::set<double> labels;
  for (const Value& item : entries) {
    p.segments.push_back(segmentOf(item, tissues, of_map));
    if (!names.insert(p.segments.back().name).second) item.fail("must have a name of its own");
    if (of_map && !labels.insert(p.segments.back().low).second) item.fail("must have a label of its own");
  }
  p.cell = 1e-3 * map["cell"].number(0.1, 1000);
  if (map.has("held"))
    for (const Value& item : map["held"].list()) {
      p.held.push_back(item.name());
      if (names.count(p.held.back()) == 0) item.fail("must be the name of a label");
    }
  if (map.has("integrator"))
    p.integrator = map["integrator"].oneOf({"backward_euler", "elastostatic", "condensed"});
  if (map.has("place")) {
    p.place = map["place"].vector3();
    if (!(p.place.cwiseAbs().maxCoeff() <= kMostPlace))
      map["place"].fail("must be within 100 m of the world's origin");
  }
  map.finish();
  return p;
}

std::string firstPatient(const std::string& name, const std::string& images, const Volume& volume,
                         bool fitting) {
  Patient first;
  first.segments.resize(2);
  first.segments[0].name = "soft_tissue", first.segments[1].name = "bone";
  first.segments[0].low = -20, first.segments[0].high = 150, first.segments[0].largest = 1;
  first.segments[1].low = 200, first.segments[1].high = 4000;
  for (Segment& s : first.segments) s.median = 1;
  return "# How a patient's images become a scene (docs/images.md). Then: vest_import bake THIS_FOLDER\n"
         "vest_patient: 1\nname: " +
         name + "\nimages: " + quoted(images) +
         "\n# crop: [[-50, -50, -50], [50, 50, 50]]   # mm, patient's axes: left, posterior, superior\n"
         "labels:                    # where they overlap, the later one counts\n"
         "  - {name: soft_tissue, tissue: liver, values: [-20, 150], median: 1, largest: 1}\n"
         "  - {name: bone, tissue: bone, values: [200, 4000], median: 1}\n" +
         firstCell(volume, first, fitting) +
         "held: [bone]               # these do not move; without this line: the lowest tenth\n" +
         kFirstPlace;
}

std::string firstOfLabels(const std::string& name, const std::string& map, const Volume& volume,
                          bool fitting) {
  std::string text =
      "# How a label map becomes a scene (docs/images.md). Then: vest_import bake THIS_FOLDER\n"
      "vest_patient: 1\nname: " +
      name + "\nlabels: " + quoted(map) + "\ntissues:                   # give each its name and tissue\n";
  Patient first;
  for (const auto& [label, voxels] : countLabels(volume)) {
    text += print("  - {label: %u, name: label_%u, tissue: liver}   # %zu voxels\n", label, label, voxels);
    first.segments.emplace_back();
    first.segments.back().low = first.segments.back().high = label;
  }
  return text + firstCell(volume, first, fitting) + kFirstPlace;
}

volume::Lattice mesh(const volume::LabelledImage& labels, const Patient& patient) {
  volume::LabelledImage turned = labels;
  turned.direction = supine() * labels.direction;
  turned.origin = supine() * labels.origin;
  volume::Lattice lattice = volume::stuffLabels(turned, patient.cell);
  Vector3d low = lattice.nodes[0], high = low;
  for (const Vector3d& n : lattice.nodes) low = low.cwiseMin(n), high = high.cwiseMax(n);
  const Vector3d from(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2]);
  for (Vector3d& n : lattice.nodes) n += patient.place - from;
  return lattice;
}

std::vector<LabelVolume> volumesOf(const volume::LabelledImage& labels, const volume::Lattice& lattice,
                                   std::size_t segments) {
  std::vector<std::size_t> voxels(segments + 1, 0);
  for (const auto label : labels.labels) ++voxels.at(label);
  std::vector<LabelVolume> volumes;
  for (std::size_t s = 1; s <= segments; ++s)
    volumes.push_back({static_cast<double>(voxels[s]) * labels.spacing.prod(),
                       volume::volumeOf(lattice, static_cast<std::uint16_t>(s))});
  return volumes;
}

std::string lossSentence(const std::vector<LabelVolume>& volumes, const Patient& patient) {
  std::string all;
  for (std::size_t s = 0; s < volumes.size(); ++s)
    if (!keepsHalf(volumes[s]))
      all += patient.segments.at(s).name + print(": %.1f ml of voxels became %.1f ml of elements, ",
                                                 1e6 * volumes[s].voxels, 1e6 * volumes[s].elements);
  if (all.empty()) return all;
  return all +
         print(
             "with cell %.3g: less than half is left; take a smaller cell, with a crop if the nodes become "
             "too many",
             1e3 * patient.cell);
}

std::string writePatientScene(const volume::Lattice& lattice, const Patient& patient,
                              const std::string& directory,
                              const std::function<void(const std::string& scene)>& check) {
  const bool condensed = patient.integrator == "condensed";
  const std::size_t most = condensed ? fem::kMostCondensedNodes : fem::kMostTissueNodes;
  if (lattice.nodes.size() > most)
    throw std::invalid_argument(
        "cell: " + print("%zu nodes; at most %zu are allowed: take a larger cell, a crop or fewer labels%s",
                         lattice.nodes.size(), most, condensed ? "" : ", or integrator: condensed"));
  const std::set<std::uint16_t> present(lattice.label.begin(), lattice.label.end());
  for (std::size_t s = 0; s < patient.segments.size(); ++s)
    if (present.count(static_cast<std::uint16_t>(s + 1)) == 0)
      throw std::invalid_argument("cell: nothing is left of " + patient.segments[s].name +
                                  ": take a smaller cell");
  WrittenScene written(directory);
  written.save(patient.name + ".vtk", toVtk(lattice, patient.name));
  std::string held = "node\n";
  for (const auto n : heldNodes(lattice, patient)) held += print("%u\n", n);
  written.save(patient.name + "_held.csv", held);
  const auto tissues = material::readDatabase(material::databasePath());
  std::string materials;
  for (std::size_t s = 0; s < patient.segments.size(); ++s) {
    const Segment& segment = patient.segments[s];
    const auto& t = tissues.at(segment.tissue);
    materials +=
        print("      - {label: %zu, of: %s, youngs_modulus: %.9g, poisson_ratio: %.9g, density: %.9g}", s + 1,
              t.name.c_str(), t.at("youngs_modulus").value, t.at("poisson_ratio").value,
              t.at("density").value) +
        "  # " + segment.name + ": " + segment.tissue + "\n";
  }
  written.save(
      patient.name + ".yaml",
      "# Written by vest_import bake; change patient.yaml instead.\nvest_scene: 1\nname: " + patient.name +
          "\ngravity: [0, 0, -9.81]\nseed: 1\nsolution: {integrator: newton_euler, dt: 0.001}\nobjects:\n  "
          "- name: " +
          patient.name + "\n    organ: " + patient.segments.front().name +
          "\n    roles: [target]\n    model: fem\n" + "    integrator: " + patient.integrator +
          (patient.integrator == "backward_euler" ? "\n    strain: corotational\n"
                                                  : "\n    strain: small\n") +
          // What answers at once would jump there in the first step.
          "    start: " + (patient.integrator == "elastostatic" ? "equilibrium" : "rest") +
          "\n    mesh: " + patient.name + ".vtk\n    fixed: " + patient.name +
          "_held.csv\n    # stiffness and density: data/materials.yaml; damping: assumed\n    "
          "rayleigh_mass: 2\n"
          "    rayleigh_stiffness: 0.004\n    materials:\n" +
          materials);
  return written.finish(patient.name + ".yaml", check);
}

}  // namespace vest::image

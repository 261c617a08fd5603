#include "loader_fem.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <tuple>

#include "../files/csv_reader.h"
#include "vessel_rings.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/fem/tissue.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/tissue_numbers.h"
#include "vest_tissue/volume/lattice.h"
#include "vest_tissue/volume/mesh_file.h"

namespace vest::scene {
namespace {

using yaml::Map;
using yaml::Value;

constexpr double kMost = kGreatest;
constexpr std::size_t kMostBoxes = 256;      // assumed
constexpr std::uint32_t kMostVoxels = 1024;  // along an axis

std::string format(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

Eigen::Vector3d vectorOf(const csv::Table& table, std::size_t row, const char* const (&names)[3]) {
  Eigen::Vector3d v;
  for (int k = 0; k < 3; ++k) v[k] = table.rows[row][static_cast<std::size_t>(table.column(names[k]))];
  return v;
}

/// Numbers as written; what is left out is the tissue's that `of` names. @return it, or null
const material::Tissue* readElasticity(Map& map, const TissueNamed& tissue, fem::Material& m) {
  const material::Tissue* const of = map.has("of") ? &tissue(map["of"]) : nullptr;
  if (of) {
    m.youngs_modulus = of->law().youngs_modulus;
    m.poisson_ratio = of->at("poisson_ratio").value;
    m.density = of->at("density").value;
  }
  if (!of || map.has("youngs_modulus")) m.youngs_modulus = map["youngs_modulus"].positive();
  if (!of || map.has("poisson_ratio")) {
    m.poisson_ratio = map["poisson_ratio"].number(-1.0, 0.5);
    if (m.poisson_ratio <= -1.0 || m.poisson_ratio >= 0.5)
      map["poisson_ratio"].fail("must be above -1 and below 0.5");
  }
  if (map.has("density")) m.density = map["density"].number(0.0, kMost);
  return of;
}

void readRayleigh(Map& map, fem::Material& m) {
  if (map.has("rayleigh_mass")) m.rayleigh_mass = map["rayleigh_mass"].number(0.0, kMost);
  if (map.has("rayleigh_stiffness")) m.rayleigh_stiffness = map["rayleigh_stiffness"].number(0.0, kMost);
}

/// One object being read: its map, its files, what comes out.
struct Reading {
  Map& map;
  const ReadFile& read;
  Object& object;
  fem::Description& d;
  std::string path;

  csv::Table table(const char* key, const std::vector<std::string>& columns) {
    const std::string bytes = read(map[key], path);
    return csv::read(path, bytes, columns, {});
  }
  /// Errors of the volume room, with the field that they are about.
  template <class F>
  auto with(const char* key, F f) -> decltype(f()) {
    try {
      return f();
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      const std::string file = files::shown(path, 4096);
      if (!path.empty() && what.compare(0, file.size(), file) == 0) throw;
      map[key].fail(what);
    }
  }
};

/// Where nodes and tetrahedra stand, for messages. Lines: of tables alone.
struct Places {
  std::string nodes, tetrahedra;
  std::vector<int> node_line, tetrahedron_line;

  [[noreturn]] void fail(bool node, std::size_t index, const std::string& value,
                         const std::string& allowed) const {
    const auto& lines = node ? node_line : tetrahedron_line;
    const char* const what = node ? "node" : "tetrahedron";
    yaml::fail(node ? nodes : tetrahedra, index < lines.size() ? lines[index] : 0,
               std::string(what) + " " + std::to_string(index), value, allowed);
  }
};

/// In a World.
std::size_t mostNodes(const fem::Description& d) {
  return d.motion == fem::Motion::Condensed ? fem::kMostCondensedNodes : fem::kMostTissueNodes;
}

void checkShape(const fem::Description& d, const Places& places, bool in_world) {
  if (in_world && d.nodes.size() > mostNodes(d)) {
    yaml::fail(places.nodes, 0, "nodes", std::to_string(d.nodes.size()),
               "must be at most " + std::to_string(mostNodes(d)) + " with integrator: newton_euler");
  }
  for (std::size_t n = 0; n < d.nodes.size(); ++n)
    for (const double c : {d.nodes[n].x(), d.nodes[n].y(), d.nodes[n].z()})
      if (!(std::abs(c) <= kFarthest))
        places.fail(true, n, "a coordinate of " + format(c), "must be from -500000 to 500000");
  std::vector<std::uint8_t> used(d.nodes.size(), 0);
  struct Face {
    std::array<fem::Index, 3> nodes;
    std::uint32_t of;  ///< tetrahedron
    bool operator<(const Face& f) const { return std::tie(nodes, of) < std::tie(f.nodes, f.of); }
  };
  std::vector<Face> faces;
  std::vector<std::pair<std::array<fem::Index, 4>, std::uint32_t>> known;
  faces.reserve(4 * d.tetrahedra.size()), known.reserve(d.tetrahedra.size());
  for (std::uint32_t e = 0; e < d.tetrahedra.size(); ++e) {
    std::array<fem::Index, 4> t = d.tetrahedra[e];
    const int is = fem::orientation({d.nodes[t[0]], d.nodes[t[1]], d.nodes[t[2]], d.nodes[t[3]]});
    if (is != 1) {
      places.fail(false, e, is < 0 ? "inverted: its volume is negative" : "flat: it has no volume",
                  "must have positive volume, (n1-n0)·((n2-n0)×(n3-n0)) > 0" +
                      std::string(is < 0 ? "; two of its nodes are to be swapped" : ""));
    }
    for (const fem::Index n : t) used[n] = 1;
    std::sort(t.begin(), t.end());
    known.emplace_back(t, e);
    faces.push_back({{t[0], t[1], t[2]}, e}), faces.push_back({{t[0], t[1], t[3]}, e});
    faces.push_back({{t[0], t[2], t[3]}, e}), faces.push_back({{t[1], t[2], t[3]}, e});
  }
  std::sort(known.begin(), known.end());
  for (std::size_t i = 1; i < known.size(); ++i)
    if (known[i].first == known[i - 1].first)
      places.fail(false, known[i].second, "stands there twice", "must stand there once");
  std::sort(faces.begin(), faces.end());
  for (std::size_t i = 2; i < faces.size(); ++i)
    if (faces[i].nodes == faces[i - 2].nodes)
      places.fail(false, faces[i].of, "the third one at a face", "must share a face with one other");
  for (std::size_t n = 0; in_world && n < used.size(); ++n)
    if (used[n] == 0)
      places.fail(true, n, "belongs to no tetrahedron", "must belong to one with integrator: newton_euler");
}

void readTables(Reading& r, Places& places) {
  const csv::Table nodes = r.table("nodes", {"node", "x", "y", "z"});
  if (nodes.rows.empty()) yaml::fail(r.path, 0, "rows", "none", "must have at least one node");
  const std::size_t most = nodes.rows.size() - 1;
  places.nodes = r.path;
  places.node_line.resize(nodes.rows.size());
  r.d.nodes.resize(nodes.rows.size());
  std::vector<bool> seen(nodes.rows.size(), false);
  for (std::size_t i = 0; i < nodes.rows.size(); ++i) {
    const std::size_t node = nodes.index(i, "node", most);
    if (seen[node]) yaml::fail(r.path, nodes.lines[i], "node", std::to_string(node), "must be there once");
    seen[node] = true;
    places.node_line[node] = nodes.lines[i];
    r.d.nodes[node] = vectorOf(nodes, i, {"x", "y", "z"});
  }
  const csv::Table tetrahedra = r.table("tetrahedra", {"n0", "n1", "n2", "n3"});
  if (tetrahedra.rows.empty()) yaml::fail(r.path, 0, "rows", "none", "must have at least one tetrahedron");
  places.tetrahedra = r.path;
  places.tetrahedron_line = tetrahedra.lines;
  for (std::size_t i = 0; i < tetrahedra.rows.size(); ++i) {
    std::array<fem::Index, 4> t{};
    const char* const names[] = {"n0", "n1", "n2", "n3"};
    for (std::size_t k = 0; k < 4; ++k) t[k] = static_cast<fem::Index>(tetrahedra.index(i, names[k], most));
    r.d.tetrahedra.push_back(t);
  }
}

/// `material` for all of it, or `materials` by label. @return as readFem()
std::vector<double> readMaterials(Reading& r, const TissueNamed& tissue,
                                  const std::vector<std::uint16_t>& label) {
  Map& map = r.map;
  std::vector<double> perfusion;
  std::vector<const material::Tissue*> named;
  if (!map.has("materials")) {
    Map material(map["material"]);
    if (const material::Tissue* of = readElasticity(material, tissue, r.d.material)) {
      r.object.material = of->name;
      takeTissue(*of, material::Condition::InVivo, r.object);
    }
    readRayleigh(material, r.d.material);
    material.finish();
    return perfusion;
  }
  if (map.has("material")) map["material"].fail("must not be there beside materials");
  if (label.empty()) map["materials"].fail("belongs to images and mesh files, which have labels");
  std::vector<int> place(65536, -1);
  for (const Value& item : map["materials"].list()) {
    Map entry(item);
    const std::uint32_t of = entry["label"].integer(0, 65535);
    if (place[of] >= 0) entry["label"].fail("must be there once");
    place[of] = static_cast<int>(r.d.materials.size());
    fem::Material m;
    const material::Tissue* const of_tissue = readElasticity(entry, tissue, m);
    perfusion.push_back(of_tissue ? of_tissue->at("perfusion").value : std::nan(""));
    named.push_back(of_tissue);
    entry.finish();
    r.d.materials.push_back(m);
  }
  readRayleigh(map, r.d.material);
  for (const std::uint16_t l : label) {
    if (place[l] < 0) map["materials"].fail("must have an entry for label " + std::to_string(l));
    r.d.cell_material.push_back(static_cast<std::uint16_t>(place[l]));
  }
  // What stands for the whole where one number is wanted: the mean over the cells.
  r.d.material.poisson_ratio = r.d.materials[0].poisson_ratio;
  std::vector<std::size_t> elements(named.size(), 0);
  for (const std::uint16_t c : r.d.cell_material) {
    if (named[c]) ++elements[c];
    r.d.material.youngs_modulus += r.d.materials[c].youngs_modulus / static_cast<double>(label.size());
    r.d.material.density += r.d.materials[c].density / static_cast<double>(label.size());
  }
  const auto most = std::max_element(elements.begin(), elements.end());
  if (most != elements.end() && *most > 0)
    takeTissue(*named[static_cast<std::size_t>(most - elements.begin())], material::Condition::InVivo,
               r.object);
  return perfusion;
}

volume::LabelledImage readImage(Reading& r, const Value& value) {
  Map map(value);
  volume::LabelledImage image;
  const auto sizes = map["size"].list();
  if (sizes.size() != 3) map["size"].fail("must be 3 whole numbers: voxels along i, j, k");
  std::size_t count = 1;
  for (std::size_t a = 0; a < 3; ++a) count *= image.size[a] = sizes[a].integer(1, kMostVoxels);
  image.spacing = map["spacing"].vector3();
  if (!(image.spacing.minCoeff() > 0.0)) map["spacing"].fail("must be > 0");
  if (map.has("origin")) image.origin = map["origin"].vector3();
  if (map.has("direction")) {
    const auto rows = map["direction"].list();
    if (rows.size() != 3)
      map["direction"].fail("must be 3 rows of 3 numbers; its columns are the axes i, j, k");
    for (int a = 0; a < 3; ++a)
      image.direction.row(a) = rows[static_cast<std::size_t>(a)].vector3().transpose();
    const Eigen::Matrix3d off = image.direction.transpose() * image.direction - Eigen::Matrix3d::Identity();
    if (!(off.cwiseAbs().maxCoeff() < 1e-4)) map["direction"].fail("must have orthonormal columns");
  }
  const std::string type = map["type"].oneOf({"uint8", "uint16"});
  const std::string bytes = r.read(map["file"], r.path);
  const std::size_t each = type == "uint8" ? 1 : 2;
  if (bytes.size() != count * each) {
    map["file"].fail("must have " + std::to_string(count * each) + " bytes (size × " + type + "); it has " +
                     std::to_string(bytes.size()));
  }
  image.labels.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto low = static_cast<std::uint8_t>(bytes[each * i]);
    const unsigned high = each == 2 ? static_cast<std::uint8_t>(bytes[2 * i + 1]) : 0u;  // little-endian
    image.labels[i] = static_cast<std::uint16_t>(low | high << 8);
  }
  map.finish();
  return image;
}

/// Lattice in an image or a closed surface. Returns the labels of its cells.
std::vector<std::uint16_t> readLattice(Reading& r, bool in_world) {
  Map& map = r.map;
  const double cell = map["cell"].number(1e-9, kFarthest);
  volume::Lattice lattice;
  volume::Surface surface;
  const bool fit = !map.has("fit") || map["fit"].boolean();
  if (map.has("image")) {
    const volume::LabelledImage image = readImage(r, map["image"]);
    r.path.clear();
    r.with("cell", [&] { lattice = volume::fillImage(image, cell); });
    if (!map.has("skin")) surface = volume::surfaceOf(image, 0.5 * cell);
  } else {
    const std::string bytes = r.read(map["surface"], r.path);
    r.with("surface", [&] { surface = volume::readSurface(r.path, bytes); });
    r.path.clear();
    r.with("surface", [&] { lattice = volume::fillSurface(surface, cell); });
  }
  if (map.has("skin")) {
    const std::string bytes = r.read(map["skin"], r.path);
    r.with("skin", [&] { surface = volume::readSurface(r.path, bytes); });
  }
  r.path.clear();
  const auto within = [&] {
    for (const Eigen::Vector3d& x : lattice.nodes)
      if (!(x.cwiseAbs().maxCoeff() <= kFarthest))
        map["cell"].fail("must leave nodes within 500000 of the origin; one is at " +
                         format(x.cwiseAbs().maxCoeff()));
  };
  within();  // before boxes around them are numbered
  r.with(map.has("skin") ? "skin" : "cell", [&] {
    if (fit) volume::fitBoundary(lattice, surface, cell);
    r.object.skin = volume::embed(lattice, surface);
  });
  within();  // the fit moved them
  if (in_world && lattice.nodes.size() > mostNodes(r.d)) {
    map["cell"].fail("gives " + std::to_string(lattice.nodes.size()) + " nodes; must give at most " +
                     std::to_string(mostNodes(r.d)) + " with integrator: newton_euler");
  }
  r.d.nodes = std::move(lattice.nodes);
  r.d.tetrahedra = std::move(lattice.tetrahedra);
  return std::move(lattice.label);
}

void readHeld(Reading& r) {
  const std::size_t most = r.d.nodes.size() - 1;
  if (r.map.has("fixed")) {
    const csv::Table fixed = r.table("fixed", {"node"});
    for (std::size_t i = 0; i < fixed.rows.size(); ++i)
      r.d.fixed.push_back(static_cast<fem::Index>(fixed.index(i, "node", most)));
  }
  if (r.map.has("fixed_boxes")) {
    if (r.map["fixed_boxes"].node().size() > kMostBoxes)
      r.map["fixed_boxes"].fail("must be at most " + std::to_string(kMostBoxes) + " boxes");
    for (const Value& item : r.map["fixed_boxes"].list()) {
      const auto corners = item.list();
      if (corners.size() != 2) item.fail("must be two corners: [[x, y, z], [x, y, z]]");
      const Eigen::Vector3d low = corners[0].vector3(), high = corners[1].vector3();
      std::size_t inside = 0;
      for (std::size_t n = 0; n <= most; ++n) {
        if ((r.d.nodes[n].array() < low.array()).any() || (r.d.nodes[n].array() > high.array()).any())
          continue;
        r.d.fixed.push_back(static_cast<fem::Index>(n));
        ++inside;
      }
      if (inside == 0) item.fail("must hold at least one node, lower corner first");
    }
  }
  if (r.map.has("loads")) {
    const csv::Table loads = r.table("loads", {"node", "fx", "fy", "fz"});
    for (std::size_t i = 0; i < loads.rows.size(); ++i) {
      r.d.loads.push_back(
          {static_cast<fem::Index>(loads.index(i, "node", most)), vectorOf(loads, i, {"fx", "fy", "fz"})});
      if (!(r.d.loads.back().force.cwiseAbs().maxCoeff() <= kMost))
        yaml::fail(r.path, loads.lines[i], "fx, fy, fz", "beyond 1e30", "must be at most 1e30");
    }
  }
}

}  // namespace

void perfuseByLabel(const std::vector<double>& perfusion, Object& object) {
  if (std::all_of(perfusion.begin(), perfusion.end(), [](double p) { return std::isnan(p); })) return;
  const fem::Description& d = *object.fem;
  std::vector<double> whole(object.rest_position.size(), 0.0);
  object.knot_perfusion.assign(whole.size(), 0.0);
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    const auto& t = d.tetrahedra[e];
    const double volume = fem::sixfoldVolume({d.nodes[t[0]], d.nodes[t[1]], d.nodes[t[2]], d.nodes[t[3]]}),
                 of = perfusion[d.cell_material[e]];
    for (const fem::Index n : t) {
      if (n >= whole.size()) continue;  // within a condensed one
      object.knot_perfusion[n] += volume * (std::isnan(of) ? object.thermal.perfusion : of);
      whole[n] += volume;
    }
  }
  for (std::size_t k = 0; k < whole.size(); ++k)
    object.knot_perfusion[k] = whole[k] > 0 ? object.knot_perfusion[k] / whole[k] : object.thermal.perfusion;
}

std::vector<double> readFem(Map& map, const ReadFile& read, const TissueNamed& tissue, bool in_world,
                            Object& object) {
  auto d = std::make_shared<fem::Description>();
  d->name = object.name;
  if (map.has("strain")) {
    d->strain = map["strain"].oneOf({"small", "corotational"}) == "small" ? fem::Strain::Small
                                                                          : fem::Strain::Corotational;
  }
  if (map.has("integrator")) {
    const std::string motion = map["integrator"].oneOf({"backward_euler", "elastostatic", "condensed"});
    if (motion == "elastostatic") d->motion = fem::Motion::Elastostatic;
    if (motion == "condensed") d->motion = fem::Motion::Condensed;
    if (d->motion != fem::Motion::BackwardEuler && d->strain == fem::Strain::Corotational)
      map["integrator"].fail("must be backward_euler with strain: corotational");
    if (d->motion == fem::Motion::Condensed && !in_world)
      map["integrator"].fail("must be backward_euler or elastostatic without a World (solution.integrator)");
  }
  if (map.has("start"))
    d->start_in_equilibrium = map["start"].oneOf({"rest", "equilibrium"}) == "equilibrium";
  if (d->start_in_equilibrium && d->motion == fem::Motion::Condensed)
    map["start"].fail("must be rest with integrator: condensed, which finds its equilibrium by itself");
  Reading r{map, read, object, *d, {}};
  std::vector<std::uint16_t> label;
  Places places;
  const bool volume = object.model == ObjectModel::Volume;
  const int shapes = (map.has("image") ? 1 : 0) + (map.has("surface") ? 1 : 0) + (map.has("mesh") ? 1 : 0) +
                     (map.has("nodes") ? 1 : 0);
  if (shapes != 1 || (volume ? map.has("nodes") : map.has("image") || map.has("surface")))
    map["model"].fail(volume ? "must have one of image, surface, mesh" : "must have one of nodes, mesh");
  for (const char* key : {"cell", "fit"}) {
    if (map.has(key) && !map.has("image") && !map.has("surface"))
      map[key].fail("belongs to image and surface");
  }
  if (map.has("mesh")) {
    const std::string bytes = read(map["mesh"], r.path);
    volume::Lattice mesh = r.with("mesh", [&] { return volume::readTetrahedra(r.path, bytes); });
    d->nodes = mesh.nodes, d->tetrahedra = mesh.tetrahedra;
    places.nodes = places.tetrahedra = r.path;
    checkShape(*d, places, in_world);
    if (map.has("skin")) {
      const std::string of_skin = read(map["skin"], r.path);
      const volume::Surface surface = r.with("skin", [&] { return volume::readSurface(r.path, of_skin); });
      r.path.clear();
      r.with("skin", [&] { object.skin = volume::embed(mesh, surface); });
    }
    label = std::move(mesh.label);
  } else if (map.has("nodes")) {
    readTables(r, places);
    checkShape(*d, places, in_world);
  } else {
    label = readLattice(r, in_world);
  }
  std::vector<double> perfusion = readMaterials(r, tissue, label);
  readHeld(r);
  object.fem = std::move(d);
  completeFem(object);
  if (!map.has("vessel_from")) return perfusion;
  if (object.tube.vessel_segment.empty()) map["vessel_from"].fail("belongs to objects with vessel_segment");
  ringsOfSurface(object.rest_position, object.contact_triangles, map["vessel_from"].vector3(), object.tube);
  if (object.tube.rings.size() < 2)
    map["vessel_from"].fail("must be at an end of a body that is longer than two of its elements");
  return perfusion;
}

}  // namespace vest::scene

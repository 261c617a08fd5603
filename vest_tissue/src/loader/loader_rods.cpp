#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

#include "../files/csv_reader.h"
#include "loader_rods.h"
#include "loader_sutures.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/rod_scene.h"

namespace vest::scene {
namespace {

using suture::HeldNode;
using suture::Hold;
using suture::RodDescription;
using suture::Section;
using yaml::Map;

// Of drives and loads (assumed); beyond them no step is finite.
constexpr double kLongest = 1e9;    // s
constexpr double kMostTurn = 1e6;   // rad
constexpr double kStrongest = 1e9;  // N

/// One rod being read.
struct RodReading {
  Map& map;
  Files& files;
  RodDescription& rod;

  csv::Table table(const char* key, const std::vector<std::string>& columns) {
    std::string path;
    const std::string bytes = files.read(map[key], path);
    return csv::read(path, bytes, columns, {});
  }
  std::size_t node(const csv::Table& t, std::size_t row) const {
    return t.index(row, "node", rod.nodes.size() - 1);
  }
};

void readNodes(RodReading& r) {
  const csv::Table table = r.table("nodes", {"node", "x", "y", "z"});
  if (table.rows.empty()) yaml::fail(table.file, 0, "rows", "none", "must have at least three nodes");
  r.rod.nodes.resize(table.rows.size());
  std::vector<int> line(table.rows.size(), 0);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::size_t node = table.index(i, "node", table.rows.size() - 1);
    if (line[node] != 0)
      yaml::fail(table.file, table.lines[i], "node", std::to_string(node), "must be there once");
    line[node] = table.lines[i];
    r.rod.nodes[node] = table.vector(i, {"x", "y", "z"}, kFarthest, "a coordinate");
  }
  const std::size_t n = r.rod.nodes.size();
  for (std::size_t i = 0; n > 1 && i + (r.rod.closed ? 0 : 1) < n; ++i) {
    const std::size_t next = (i + 1) % n;
    if (r.rod.nodes[i] == r.rod.nodes[next])
      yaml::fail(table.file, line[next], "node", std::to_string(next),
                 "must be away from node " + std::to_string(i) + ": a segment of the rod has a length");
  }
}

Section readSuture(const Value& value, Files& files) {
  Map map(value);
  map.only({"material", "size"});
  const Section section = readSutureKind(map, files.sutures()).rod.section;
  map.finish();
  return section;
}

Section readSection(const Value& value, Files& files) {
  Map map(value);
  if (map.has("suture")) {
    map.only({"suture"});
    return readSuture(map["suture"], files);
  }
  const bool solid = map.has("youngs_modulus");
  if (solid)
    map.only({"radius", "density", "youngs_modulus", "poisson_ratio"});
  else
    map.only({"radius", "linear_density", "stretch", "bend", "twist"});
  const double radius = map["radius"].positive();
  Section s;
  if (solid) {
    const double density = map["density"].positive(), e = map["youngs_modulus"].positive();
    s = suture::solidSection(radius, density, e, map["poisson_ratio"].number(0.0, 0.5));
  } else {
    s.radius = radius;
    s.linear_density = map["linear_density"].positive();
    s.stretch = map["stretch"].positive();
    s.bend = map["bend"].positive();
    s.twist = map["twist"].positive();
    // GA/EA = GJ/(2·EI) of a round section, within what Poisson's ratio allows.
    s.shear = s.stretch * std::clamp(0.5 * s.twist / s.bend, 1.0 / 3.0, 0.5);
  }
  s.friction = 0.1;
  map.finish();
  return s;
}

void readHeld(RodReading& r) {
  std::map<std::size_t, std::size_t> at;  // node -> number in rod.held
  const csv::Table held = r.table("held", {"node", "kind"});
  for (std::size_t i = 0; i < held.rows.size(); ++i) {
    HeldNode h;
    h.node = static_cast<suture::Index>(r.node(held, i));
    h.hold = held.index(i, "kind", 1) == 0 ? Hold::Place : Hold::Frame;
    if (!at.emplace(h.node, r.rod.held.size()).second)
      yaml::fail(held.file, held.lines[i], "node", std::to_string(h.node), "must be there once");
    r.rod.held.push_back(h);
  }
  if (!r.map.has("drive")) return;
  const csv::Table drive = r.table("drive", {"t", "node", "x", "y", "z", "angle"});
  for (std::size_t i = 0; i < drive.rows.size(); ++i) {
    const std::size_t node = r.node(drive, i);
    const auto found = at.find(node);
    if (found == at.end())
      yaml::fail(drive.file, drive.lines[i], "node", std::to_string(node), "must be one that `held` names");
    auto& rows = r.rod.held[found->second].drive;
    const double t = drive.within(i, "t", kLongest, "a time in s");
    if (!rows.empty() && !(t > rows.back().t))
      yaml::fail(drive.file, drive.lines[i], "t", std::to_string(t),
                 "must be greater than in the row before of this node");
    const double angle = drive.within(i, "angle", kMostTurn, "an angle in rad");
    if (angle != 0.0 && r.rod.held[found->second].hold == Hold::Place)
      yaml::fail(drive.file, drive.lines[i], "angle", std::to_string(angle), "must be 0 at a node of kind 0");
    rows.push_back({t, drive.vector(i, {"x", "y", "z"}, kFarthest, "a coordinate"), angle});
  }
}

RodDescription readRod(const Value& value, Files& files) {
  Map map(value);
  map.only({"name", "model", "nodes", "closed", "rod", "suture", "natural", "turn", "friction", "damping",
            "held", "drive", "loads"});
  RodDescription rod;
  rod.name = map["name"].name();
  rod.closed = map.has("closed") && map["closed"].boolean();
  RodReading r{map, files, rod};
  if (map.has("suture") && map.has("rod")) map["suture"].fail("must not be there beside `rod`");
  rod.section = map.has("suture") ? readSuture(map["suture"], files) : readSection(map["rod"], files);
  readNodes(r);
  if (map.has("natural")) rod.natural_shape = map["natural"].oneOf({"straight", "shape"}) == "shape";
  if (map.has("turn")) rod.turn = map["turn"].number(-1e5, 1e5);
  if (map.has("friction"))  // the same at any load
    rod.section.friction = map["friction"].number(0.0, 1e3), rod.section.friction_fall = 0.0;
  if (map.has("damping")) rod.section.damping = map["damping"].number(0.0, 1e12);
  if (map.has("held"))
    readHeld(r);
  else if (map.has("drive"))
    map["drive"].fail("moves nodes that `held` names, and there is no `held`");
  if (map.has("loads")) {
    const csv::Table loads = r.table("loads", {"node", "fx", "fy", "fz"});
    for (std::size_t i = 0; i < loads.rows.size(); ++i)
      rod.loads.push_back({static_cast<suture::Index>(r.node(loads, i)),
                           loads.vector(i, {"fx", "fy", "fz"}, kStrongest, "a force in N")});
  }
  map.finish();
  return rod;
}

suture::Cylinder readCylinder(const Value& value) {
  Map map(value);
  map.only({"name", "model", "point", "axis", "radius", "friction"});
  suture::Cylinder c;
  c.name = map["name"].name();
  c.point = map["point"].vector3();
  c.axis = map["axis"].vector3();
  if (!(c.axis.norm() > 0.0)) map["axis"].fail("must have a length");
  c.radius = map["radius"].positive();
  c.friction = map.has("friction") ? map["friction"].number(0.0, 1e3) : 0.1;
  map.finish();
  return c;
}

void readSolution(const Value& value, RodScene& scene) {
  Map solution(value);
  if (solution.has("integrator"))
    scene.equilibrium =
        solution["integrator"].oneOf({"newton_euler", "backward_euler", "static"}) == "static";
  if (solution.has("dt")) scene.dt = solution["dt"].number(1e-9, 1e9);
  solution.finish();
}

/// A rod as a World has it: it never breaks.
Suture asSuture(const RodDescription& rod) {
  constexpr double kEndless = 1e30;  // N
  Suture s;
  s.rod = rod;
  s.strength = s.knot_strength = kEndless;
  s.friction = rod.section.friction;
  return s;
}

}  // namespace

bool isRodOrCylinder(const Value& object) {
  if (!object.isMap()) return false;
  const YAML::Node model = object.node()["model"];
  return model && model.IsScalar() && (model.Scalar() == "rod" || model.Scalar() == "cylinder");
}

void readRodOrCylinder(const Value& object, Files& files, suture::Description& objects) {
  Map map(object);
  if (map["model"].string() == "rod")
    objects.rods.push_back(readRod(object, files));
  else
    objects.cylinders.push_back(readCylinder(object));
}

bool hasRods(const std::string& path) {
  const Value root = yaml::parse(path, yaml::readFile(path, yaml::kMaxBytes));
  Map map(root);
  if (!map.has("objects") || !map["objects"].isList()) return false;
  const auto objects = map["objects"].list();
  return std::any_of(objects.begin(), objects.end(), isRodOrCylinder);
}

RodScene loadRods(const std::string& path) {
  const std::string text = yaml::readFile(path, yaml::kMaxBytes);
  const Value root = yaml::parse(path, text);
  const auto slash = path.find_last_of('/');
  Files files(path, slash == std::string::npos ? "." : path.substr(0, slash), text, nullptr);
  Map map(root);
  RodScene scene;
  const auto listed = map["objects"].list();
  if (!std::all_of(listed.begin(), listed.end(), isRodOrCylinder)) {
    scene.together = loadTogether(path, scene.objects, scene.equilibrium);
    if (scene.objects.rods.empty()) map["objects"].fail("must have at least one rod beside cylinders");
    for (const RodDescription& rod : scene.objects.rods) scene.together->sutures.push_back(asSuture(rod));
    scene.together->cylinders = scene.objects.cylinders;
    scene.objects.gravity = scene.together->gravity;
    scene.hash = scene.together->hash;
    scene.dt = scene.together->dt;
    return scene;
  }
  map.only({"vest_scene", "name", "gravity", "seed", "solution", "objects"});
  if (map.has("vest_scene")) map["vest_scene"].integer(1, 1);
  if (map.has("name")) map["name"].name();
  if (map.has("seed")) map["seed"].integer(0, 4294967295u);
  scene.objects.gravity = map.has("gravity") ? map["gravity"].vector3() : Eigen::Vector3d(0, 0, -9.81);
  if (map.has("solution")) readSolution(map["solution"], scene);
  std::set<std::string> names;
  for (const Value& object : listed) {
    readRodOrCylinder(object, files, scene.objects);
    if (!names.insert(Map(object)["name"].name()).second) Map(object)["name"].fail("must be there once");
  }
  if (scene.objects.rods.empty()) map["objects"].fail("must have at least one rod beside cylinders");
  map.finish();
  scene.hash = files.hash();
  return scene;
}

}  // namespace vest::scene

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "../files/csv_reader.h"
#include "loader_fem.h"
#include "loader_image.h"
#include "loader_living.h"
#include "loader_rods.h"
#include "loader_sutures.h"
#include "side_files.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/cache/block.h"
#include "vest_tissue/fem/cache.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/edits.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/scene_files.h"
#include "vest_tissue/scene/tissue_numbers.h"
#include "vest_tissue/scene/world.h"

namespace vest::scene {
namespace {

using yaml::Map;
using yaml::Value;

constexpr std::size_t kMaxObjects = 1000;

/// The law as written; what is left out is that of `law`, where there is one.
material::Law readLaw(const Value& value, material::Law law) {
  Map map(value);
  if (map.has("youngs_modulus") || !(law.youngs_modulus > 0))
    law.youngs_modulus = map["youngs_modulus"].positive();
  if (map.has("a2")) law.a2 = map["a2"].number(-1e6, 1e6);
  if (map.has("a3")) law.a3 = map["a3"].number(-1e6, 1e6);
  if (map.has("a4")) law.a4 = map["a4"].number(-1e6, 1e6);
  if (map.has("max_strain")) law.max_strain = map["max_strain"].number(1e-3, 10);
  map.finish();
  return law;
}

// Material of a net given by tables: what the springs and knots need beside their own columns.
struct PlainMaterial {
  double density = 1000, poisson_ratio = 0.25, rayleigh_mass = 0, rayleigh_stiffness = 0, area = 0;
};

material::Condition conditionOf(Map& map) {
  if (!map.has("condition")) return material::Condition::InVivo;
  return map["condition"].oneOf({"in_vivo", "post_mortem"}) == "post_mortem" ? material::Condition::PostMortem
                                                                             : material::Condition::InVivo;
}

/// `material: NAME` of the database, or a map: numbers, or `of: NAME` with numbers that replace its own.
PlainMaterial readMaterial(const Value& value, Files& files, Object& object) {
  PlainMaterial material;
  const auto use = [&](const Value& name, material::Condition condition) {
    const material::Tissue& tissue = files.material(name);
    object.material = tissue.name;
    takeTissue(tissue, condition, object);
    object.law = tissue.law(condition);
    material.density = object.density = tissue.at("density", condition).value;
    material.poisson_ratio = tissue.at("poisson_ratio", condition).value;
  };
  if (value.isScalar()) {
    use(value, material::Condition::InVivo);
    return material;
  }
  Map map(value);
  const material::Condition condition = conditionOf(map);
  if (map.has("of")) use(map["of"], condition);
  if (map.has("youngs_modulus") || !map.has("of"))
    object.law.youngs_modulus = map["youngs_modulus"].positive();
  if (map.has("poisson_ratio")) material.poisson_ratio = map["poisson_ratio"].number(0, 0.4999);
  if (map.has("density")) material.density = map["density"].positive();
  if (map.has("rayleigh_mass")) material.rayleigh_mass = map["rayleigh_mass"].number(0, 1e9);
  if (map.has("rayleigh_stiffness")) material.rayleigh_stiffness = map["rayleigh_stiffness"].number(0, 1e9);
  if (map.has("a2")) object.law.a2 = map["a2"].number(-1e6, 1e6);
  if (map.has("a3")) object.law.a3 = map["a3"].number(-1e6, 1e6);
  if (map.has("a4")) object.law.a4 = map["a4"].number(-1e6, 1e6);
  if (map.has("max_strain")) object.law.max_strain = map["max_strain"].number(1e-3, 10);
  map.finish();
  object.density = material.density;
  return material;
}

void readNodes(const csv::Table& table, double mass, Object& object) {
  const int own_mass = table.column("mass");
  object.rest_position.resize(table.rows.size());
  object.mass.assign(table.rows.size(), mass);
  std::vector<bool> seen(table.rows.size(), false);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::size_t node = table.index(i, "node", table.rows.size() - 1);
    if (seen[node])
      yaml::fail(table.file, table.lines[i], "node", std::to_string(node), "must be there once");
    seen[node] = true;
    const auto& row = table.rows[i];
    object.rest_position[node] = table.vector(i, {"x", "y", "z"}, kFarthest, "a coordinate");
    if (own_mass >= 0) object.mass[node] = row[static_cast<std::size_t>(own_mass)];
    if (!(object.mass[node] > 0)) {
      yaml::fail(table.file, table.lines[i], "mass", std::to_string(object.mass[node]),
                 "must be > 0 (a column mass, or knot_mass in the scene file)");
    }
  }
}

void readLinks(const csv::Table& table, const PlainMaterial& material, double area, Object& object) {
  const std::size_t most = object.rest_position.size() - 1;
  const auto cell = [&](std::size_t row, const char* name, double otherwise) {
    const int column = table.column(name);
    return column < 0 ? otherwise : table.rows[row][static_cast<std::size_t>(column)];
  };
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    Link link;
    const double kind = cell(i, "kind", 0);
    if (kind != 0 && kind != 1 && kind != 2) {
      yaml::fail(table.file, table.lines[i], "kind", std::to_string(kind),
                 "must be 0 elastic, 1 viscous or 2 plastic");
    }
    link.kind = static_cast<LinkKind>(static_cast<int>(kind));
    link.knot0 = static_cast<Index>(table.index(i, "n0", most));
    link.knot1 = static_cast<Index>(table.index(i, "n1", most));
    link.rest =
        cell(i, "rest_length", (object.rest_position[link.knot1] - object.rest_position[link.knot0]).norm());
    link.stiffness = cell(i, "stiffness", 0);
    link.area = link.stiffness > 0 ? 0 : area;
    const double k = link.stiffness > 0 ? link.stiffness : object.law.youngs_modulus * area / link.rest;
    link.damping = cell(i, "damping", link.kind == LinkKind::Elastic ? material.rayleigh_stiffness * k : 0);
    object.links.push_back(link);
  }
}

void readTables(Map& map, Files& files, Object& object) {
  PlainMaterial material;
  material = readMaterial(map["material"], files, object);
  std::string path;
  const std::string nodes = files.read(map["nodes"], path);
  const csv::Table table = csv::read(path, nodes, {"node", "x", "y", "z"}, {"mass"});
  if (table.rows.empty()) yaml::fail(path, 0, "rows", "none", "must have at least one node");
  const double mass = map.has("knot_mass") ? map["knot_mass"].positive() : 0.0;
  readNodes(table, mass, object);
  object.position = object.rest_position;
  for (const double m : object.mass) object.damping.push_back(material.rayleigh_mass * m);
  object.fixed.assign(object.mass.size(), 0);
  const double area = map.has("link_area") ? map["link_area"].positive() : 0.0;
  const std::string links = files.read(map["links"], path);
  readLinks(csv::read(path, links, {"n0", "n1"}, {"rest_length", "stiffness", "damping", "kind"}), material,
            area, object);
  if (map.has("fixed")) {
    const std::string bytes = files.read(map["fixed"], path);
    const csv::Table fixed = csv::read(path, bytes, {"node"}, {});
    for (std::size_t i = 0; i < fixed.rows.size(); ++i)
      object.fixed[fixed.index(i, "node", object.mass.size() - 1)] = 1;
  }
  if (map.has("triangles")) {
    const std::string bytes = files.read(map["triangles"], path);
    const csv::Table triangles = csv::read(path, bytes, {"n0", "n1", "n2"}, {});
    for (std::size_t i = 0; i < triangles.rows.size(); ++i) {
      std::array<Index, 3> triangle{};
      const char* names[] = {"n0", "n1", "n2"};
      for (std::size_t k = 0; k < 3; ++k)
        triangle[k] = static_cast<Index>(triangles.index(i, names[k], object.mass.size() - 1));
      object.contact_triangles.push_back(triangle);
    }
  }
}

/// `knot_perfusion`: blood of single knots, where the scene knows better than the material.
void readPerfusion(Map& map, Files& files, Object& object) {
  if (!map.has("knot_perfusion")) return;
  std::string path;
  const std::string bytes = files.read(map["knot_perfusion"], path);
  const csv::Table table = csv::read(path, bytes, {"node", "perfusion"}, {});
  object.knot_perfusion.resize(object.rest_position.size(), object.thermal.perfusion);
  std::vector<bool> seen(object.rest_position.size(), false);
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const std::size_t node = table.index(i, "node", object.rest_position.size() - 1);
    if (seen[node])
      yaml::fail(table.file, table.lines[i], "node", std::to_string(node), "must be there once");
    seen[node] = true;
    const double perfusion = table.rows[i][static_cast<std::size_t>(table.column("perfusion"))];
    if (!(perfusion >= 0 && perfusion <= 1))
      yaml::fail(table.file, table.lines[i], "perfusion", std::to_string(perfusion),
                 "must be from 0 to 1 (1/s)");
    object.knot_perfusion[node] = perfusion;
  }
}

Object readObject(const Value& value, Files& files, bool in_world) {
  Map map(value);
  if (map.has("baked")) {
    map.only({"name",
              "organ",
              "material",
              "roles",
              "model",
              "baked",
              "law",
              "density",
              "friction",
              "contact_thickness",
              "full_contact",
              "vessel_segment",
              "tear_strain",
              "cut_toughness",
              "puncture_force",
              "wall_thickness",
              "thermal",
              "knot_perfusion",
              "grasp_damage_threshold",
              "motility"});
  } else {
    map.only({"name",
              "organ",
              "material",
              "roles",
              "model",
              "nodes",
              "links",
              "fixed",
              "triangles",
              "knot_mass",
              "link_area",
              "friction",
              "contact_thickness",
              "full_contact",
              "vessel_segment",
              "vessel_from",
              "tear_strain",
              "cut_toughness",
              "puncture_force",
              "wall_thickness",
              "strain",
              "tetrahedra",
              "loads",
              "integrator",
              "mesh",
              "image",
              "surface",
              "skin",
              "cell",
              "fit",
              "materials",
              "fixed_boxes",
              "rayleigh_mass",
              "rayleigh_stiffness",
              "start",
              "thermal",
              "knot_perfusion",
              "grasp_damage_threshold",
              "motility"});
  }
  Object object;
  object.name = map["name"].name();
  object.organ = map.has("organ") ? map["organ"].name() : "tissue";
  if (map.has("roles")) {
    for (const Value& role : map["roles"].list()) object.roles.push_back(role.name());
  }
  if (map.has("model") && (map["model"].string() == "rod" || map["model"].string() == "cylinder"))
    map["model"].fail("must be net, fem, volume or rigid; rods and cylinders are for vest_simulate");
  const std::string model = map.has("model") ? map["model"].oneOf({"net", "fem", "volume", "rigid"}) : "net";
  object.model = model == "rigid"    ? ObjectModel::Rigid
                 : model == "fem"    ? ObjectModel::Fem
                 : model == "volume" ? ObjectModel::Volume
                                     : ObjectModel::Net;
  const bool elements = object.model == ObjectModel::Fem || object.model == ObjectModel::Volume;
  for (const char* of_fem :
       {"strain", "tetrahedra", "loads", "integrator", "mesh", "image", "surface", "skin", "cell", "fit",
        "materials", "vessel_from", "fixed_boxes", "rayleigh_mass", "rayleigh_stiffness", "start"}) {
    if (!elements && map.has(of_fem)) map[of_fem].fail("belongs to objects with model: fem or volume");
  }
  if (map.has("puncture_force")) object.puncture_force = map["puncture_force"].number(0, 1e3);
  if (map.has("wall_thickness")) object.wall_thickness = map["wall_thickness"].number(0, 1e3);
  if (map.has("contact_thickness")) object.contact_thickness = map["contact_thickness"].number(0, 1e6);
  if (map.has("full_contact")) object.full_contact = map["full_contact"].boolean();
  if (map.has("vessel_segment")) object.tube.vessel_segment = map["vessel_segment"].name();
  std::string path = value.file();
  if (elements) {
    const std::vector<double> by_label = readFem(
        map, [&files](const Value& name, std::string& file) { return files.read(name, file); },
        [&files](const Value& name) -> const material::Tissue& { return files.material(name); }, in_world,
        object);
    readLiving(map, object);
    perfuseByLabel(by_label, object);
    readPerfusion(map, files, object);
    map.finish();
    return object;
  }
  if (map.has("baked")) {
    object.material = map["material"].name();
    if (const material::Tissue* tissue = files.known(object.material))
      takeTissue(*tissue, material::Condition::InVivo, object);
    if (!map.has("law") || !map.has("density")) {  // the database's
      const material::Tissue& tissue = files.material(map["material"]);
      object.law = tissue.law();
      object.density = tissue.at("density").value;
    }
    if (map.has("law")) object.law = readLaw(map["law"], object.law);
    if (map.has("density")) object.density = map["density"].positive();
    const std::string bytes = files.read(map["baked"], path);
    decodeBaked(bytes, path, object);
  } else {
    readTables(map, files, object);
  }
  readLiving(map, object);
  readPerfusion(map, files, object);
  map.finish();
  checkObject(object, path);
  return object;
}

void readConnections(const Value& value, Files& files, Description& description) {
  std::string path;
  const std::string bytes = files.read(value, path);
  const csv::Table table =
      csv::read(path, bytes,
                {"object0", "knot0", "object1", "t0", "t1", "t2", "w0", "w1", "w2", "offset_x", "offset_y",
                 "offset_z", "stiffness", "damping", "break_force"},
                {});
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const auto cell = [&](const char* name) {
      return table.rows[i][static_cast<std::size_t>(table.column(name))];
    };
    const auto refuse = [&](const char* name, const char* allowed) {
      yaml::fail(path, table.lines[i], name, std::to_string(cell(name)), allowed);
    };
    Connection connection;
    const std::size_t first = table.index(i, "object0", description.objects.size() - 1);
    const std::size_t second = table.index(i, "object1", description.objects.size() - 1);
    if (first == second) refuse("object1", "must be another object than object0");
    const Object& object1 = description.objects[second];
    connection.object0 = description.objects[first].name;
    connection.object1 = object1.name;
    connection.knot0 =
        static_cast<Index>(table.index(i, "knot0", description.objects[first].mass.size() - 1));
    const char* knots[] = {"t0", "t1", "t2"};
    const char* weights[] = {"w0", "w1", "w2"};
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      connection.triangle1[k] = static_cast<Index>(table.index(i, knots[k], object1.mass.size() - 1));
      connection.weights1[k] = cell(weights[k]);
      sum += connection.weights1[k];
    }
    if (!(std::abs(sum - 1) < 1e-4)) refuse("w0", "w0, w1 and w2 must sum to 1");
    connection.offset = {cell("offset_x"), cell("offset_y"), cell("offset_z")};
    connection.stiffness = cell("stiffness");
    connection.damping = cell("damping");
    connection.break_force = cell("break_force");
    for (const char* name : {"offset_x", "offset_y", "offset_z", "w0", "w1", "w2"})
      if (!(std::abs(cell(name)) <= kFarthest)) refuse(name, "must be within 500000 of 0");
    if (!(connection.stiffness > 0 && connection.stiffness <= kGreatest))
      refuse("stiffness", "must be > 0, at most 1e30");
    if (!(connection.damping >= 0 && connection.damping <= kGreatest))
      refuse("damping", "must be from 0 to 1e30");
    if (!(connection.break_force >= 0 && connection.break_force <= kGreatest))
      refuse("break_force", "must be from 0 to 1e30; 0: never breaks");
    description.connections.push_back(connection);
  }
}

/// Trees of vessels: their three files each belong to the scene; the circulation reads them.
void readVessels(const Value& value, Files& files, Description& description) {
  for (const Value& item : value.list()) {
    Map map(item);
    VesselTree tree;
    tree.folder = map["case"].name();
    tree.supply = map["supply"].name();
    map.finish();
    for (const auto& [name, bytes] : {std::pair{"case.json", &tree.case_json},
                                      {"network.csv", &tree.network_csv},
                                      {"inflow.csv", &tree.inflow_csv}}) {
      std::string path;
      *bytes = files.read(map["case"], path, tree.folder + "/" + name);
    }
    description.vessels.push_back(std::move(tree));
  }
}

/// The object that was read last has a name of its own.
void checkName(const Value& item, const Description& d, const suture::Description* rods) {
  const std::string name = Map(item)["name"].name();
  const auto same = [&name](const auto& other) { return other.name == name; };
  auto times = std::count_if(d.objects.begin(), d.objects.end(), same);
  if (rods)
    times += std::count_if(rods->rods.begin(), rods->rods.end(), same) +
             std::count_if(rods->cylinders.begin(), rods->cylinders.end(), same);
  if (times > 1) Map(item)["name"].fail("must be there once");
}

/// Rods and cylinders that are listed as objects, where they are allowed.
struct Rods {
  suture::Description& objects;
  bool& equilibrium;  ///< `integrator: static`
};

Description load(const std::string& path, SceneFiles* kept, const Rods* rods = nullptr) {
  const std::string text = yaml::readFile(path, yaml::kMaxBytes);
  const Value root = yaml::parse(path, text);
  const auto slash = path.find_last_of('/');
  Description description;
  description.directory = slash == std::string::npos ? "." : path.substr(0, slash);
  if (kept) *kept = {{{path.substr(slash == std::string::npos ? 0 : slash + 1), text}}, ""};
  Files files(path, description.directory, text, kept);
  Map map(root);
  map.only({"vest_scene", "name", "gravity", "seed", "solution", "source", "objects", "connections",
            "connect", "vessels", "sutures", "image"});
  if (map.has("vest_scene")) map["vest_scene"].integer(1, 1);
  if (map.has("name"))
    description.name = map["name"].name();
  else
    description.name = files::shown(path.substr(slash == std::string::npos ? 0 : slash + 1), 64);
  if (map.has("gravity")) description.gravity = map["gravity"].vector3();
  if (map.has("seed")) description.seed = map["seed"].integer(0, 4294967295u);
  if (map.has("solution")) {
    Map solution(map["solution"]);
    if (solution.has("integrator")) {
      const std::string word = solution["integrator"].oneOf({"newton_euler", "backward_euler", "static"});
      if (word == "backward_euler") description.integrator = Integrator::BackwardEuler;
      if (word == "static") description.integrator = Integrator::Static;
    }
    // Backward Euler is stable at any step, and its scenes may be of another unit system.
    const bool explicit_steps = description.integrator == Integrator::NewtonEuler;
    if (solution.has("dt")) {
      description.dt = explicit_steps ? solution["dt"].number(1e-6, 0.01) : solution["dt"].positive();
    }
    solution.finish();
  }
  if (rods) {  // a World moves them together with all others
    rods->equilibrium = description.integrator == Integrator::Static;
    description.integrator = Integrator::NewtonEuler;
  }
  std::string source_path;
  if (map.has("source")) {
    files.read(map["source"], source_path);
    description.source = map["source"].string();
  }
  const bool any = map.has("objects") || !map.has("image");  // an image alone is a scene, too
  if (any && map["objects"].node().size() > kMaxObjects)
    map["objects"].fail("must be 1 to " + std::to_string(kMaxObjects) + " objects");
  const auto objects = any ? map["objects"].list() : std::vector<Value>();
  if (any && objects.empty()) map["objects"].fail("must be 1 to " + std::to_string(kMaxObjects) + " objects");
  if (description.integrator == Integrator::NewtonEuler &&
      description.gravity.cwiseAbs().maxCoeff() > kMostGravity)
    map["gravity"].fail("must be from -100 to 100 m/s² along each axis with integrator: newton_euler");
  for (const Value& item : objects) {
    if (rods && isRodOrCylinder(item)) {
      readRodOrCylinder(item, files, rods->objects);
      checkName(item, description, &rods->objects);
      continue;
    }
    Object object = readObject(item, files, description.integrator == Integrator::NewtonEuler);
    description.objects.push_back(std::move(object));
    checkName(item, description, rods ? &rods->objects : nullptr);
    checkCounts(description, path);  // now: each may be large
  }
  if (map.has("image")) {
    if (description.integrator != Integrator::NewtonEuler)
      map["image"].fail("belongs to scenes with integrator: newton_euler");
    readFeltImage(
        map["image"], [&files](const Value& name, std::string& file) { return files.read(name, file); },
        description);
  }
  if (map.has("connections")) readConnections(map["connections"], files, description);
  if (map.has("connect")) readNearestConnections(map["connect"], description);
  if (map.has("vessels")) readVessels(map["vessels"], files, description);
  if (map.has("sutures")) {
    if (rods) map["sutures"].fail("belongs to sessions; beside objects of model rod there are none");
    if (description.integrator != Integrator::NewtonEuler)
      map["sutures"].fail("belongs to scenes with integrator: newton_euler; vest_simulate moves rods");
    std::vector<std::string> taken;
    for (const Object& o : description.objects) taken.push_back(o.name);
    description.sutures = readSutures(map["sutures"], files.sutures(), taken);
  }
  checkTogether(description, path);  // with sutures
  map.finish();
  description.hash = files.hash();
  for (Object& object : description.objects) {
    if (description.integrator != Integrator::NewtonEuler || !object.fem || !object.fem->start_in_equilibrium)
      continue;
    try {
      settleFem(object, description.gravity);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(files::shown(path, 4096) + ": " + error.what());
    }
  }
  description.cache_directory = cache::defaultDirectory();
  return description;
}

}  // namespace

Description loadScene(const std::string& path) {
  return load(path, nullptr);
}

Description loadTogether(const std::string& path, suture::Description& rods, bool& equilibrium) {
  const Rods allowed{rods, equilibrium};
  return load(path, nullptr, &allowed);
}

Description loadScene(const std::string& path, SceneFiles& files) {
  return load(path, &files);
}

}  // namespace vest::scene

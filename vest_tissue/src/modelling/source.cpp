#include "vest_tissue/modelling/source.h"

#include <algorithm>
#include <filesystem>
#include <set>

#include <xxhash.h>

#include "../loader/loader_living.h"
#include "../loader/loader_sutures.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/fields.h"

namespace vest::modelling {
namespace {

using scene::yaml::Map;
using scene::yaml::Value;

const std::vector<std::string> kLinkWords = {"ring2", "strut", "long2", "cross", "leaf"};
const std::vector<LinkClass> kLinkClasses = {LinkClass::Ring2, LinkClass::Strut, LinkClass::Long2,
                                             LinkClass::Cross, LinkClass::Leaf};

/// A number in the range that its field has.
double within(const Value& value, const char* path) {
  const Field& field = *fieldOf(path);
  if (field.kind == Field::Kind::Positive) return value.positive();
  return value.number(field.least, field.most);
}

std::uint32_t countWithin(const Value& value, const char* path) {
  const Field& field = *fieldOf(path);
  return value.integer(static_cast<std::uint32_t>(field.least), static_cast<std::uint32_t>(field.most));
}

std::vector<Vector3> points(const Value& value) {
  std::vector<Vector3> result;
  for (const Value& item : value.list()) result.push_back(item.vector3());
  if (result.size() < 2) value.fail("must be a list of two or more points");
  return result;
}

End endOf(const Value& value) {
  return value.oneOf({"pole", "cap"}) == "pole" ? End::Pole : End::Cap;
}

int signedInteger(const Value& value) {
  const double number = value.number(-10000, 10000);
  if (number != static_cast<int>(number)) value.fail("must be a whole number");
  return static_cast<int>(number);
}

Rings ringsOf(const Value& value) {  // [first, last] or [first, last, step]
  const auto items = value.list();
  if (items.size() < 2 || items.size() > 3) value.fail("must be [first, last] or [first, last, step]");
  Rings rings{signedInteger(items[0]), signedInteger(items[1]), 1, value.line()};
  if (items.size() == 3) rings.step = static_cast<int>(items[2].integer(1, 1000));
  return rings;
}

TubeSpec tubeOf(const Value& value) {
  Map map(value);
  TubeSpec spec;
  spec.centre = points(map["centre"]);
  for (const Value& item : map["sections"].list()) {
    Map section(item);
    Section result;
    result.at = within(section["at"], "tube/sections/*/at");
    for (const Value& radius : section["radii"].list())
      result.radii.push_back(within(radius, "tube/sections/*/radii/*"));
    if (result.radii.empty() || result.radii.size() == 3)
      item.fail("radii: 1 (circle), 2 (ellipse) or at least 4");
    if (!spec.sections.empty() && !(result.at > spec.sections.back().at)) item.fail("sections must ascend");
    section.finish();
    spec.sections.push_back(std::move(result));
  }
  if (map.has("reference")) spec.reference = map["reference"].vector3();
  spec.rings = countWithin(map["rings"], "tube/rings");
  spec.around = countWithin(map["around"], "tube/around");
  if (map.has("start")) spec.start = endOf(map["start"]);
  if (map.has("end")) spec.end = endOf(map["end"]);
  if (map.has("start_dome")) spec.start_dome = within(map["start_dome"], "tube/start_dome");
  if (map.has("end_dome")) spec.end_dome = within(map["end_dome"], "tube/end_dome");
  if (map.has("start_mouth")) spec.start_mouth = within(map["start_mouth"], "tube/start_mouth");
  if (map.has("end_mouth")) spec.end_mouth = within(map["end_mouth"], "tube/end_mouth");
  if (map.has("wall_thickness")) spec.wall_thickness = within(map["wall_thickness"], "tube/wall_thickness");
  if (map.has("density")) {
    for (const Value& item : map["density"].list()) {
      const auto pair = item.list();
      if (pair.size() != 2) item.fail("must be [fraction, density]");
      spec.density.push_back({pair[0].number(0, 1), pair[1].number(0.01, 100)});
      if (spec.density.size() > 1 && !(spec.density.back()[0] > spec.density[spec.density.size() - 2][0])) {
        item.fail("fractions must ascend");
      }
    }
  }
  if (map.has("inside")) spec.inside = map["inside"].boolean();
  map.finish();
  return spec;
}

SheetSpec sheetOf(const Value& value) {
  Map map(value);
  SheetSpec spec;
  for (const Value& item : map["curves"].list()) spec.curves.push_back(points(item));
  spec.stations = countWithin(map["stations"], "sheet/stations");
  spec.height_knots = countWithin(map["height_knots"], "sheet/height_knots");
  spec.thickness = within(map["thickness"], "sheet/thickness");
  map.finish();
  return spec;
}

RevolveSpec revolveOf(const Value& value) {
  Map map(value);
  RevolveSpec spec;
  spec.origin = map["origin"].vector3();
  spec.axis = map["axis"].vector3();
  if (!(spec.axis.norm() > 1e-9)) map["axis"].fail("must be a direction");
  if (map.has("reference")) spec.reference = map["reference"].vector3();
  for (const Value& item : map["profile"].list()) {
    const auto pair = item.list();
    if (pair.size() != 2) item.fail("must be [height, radius]");
    spec.profile.push_back({within(pair[0], "revolve/profile/*/0"), within(pair[1], "revolve/profile/*/1")});
  }
  if (spec.profile.size() < 2) map["profile"].fail("must be two or more of [height, radius]");
  spec.rings = countWithin(map["rings"], "revolve/rings");
  spec.around = countWithin(map["around"], "revolve/around");
  if (map.has("wall_thickness"))
    spec.wall_thickness = within(map["wall_thickness"], "revolve/wall_thickness");
  map.finish();
  return spec;
}

/// What a wall of elements cannot have, since it belongs to nets.
void readLayers(Map& map, ObjectSource& object) {
  for (const char* of_net :
       {"springs", "fillers", "bulk_modulus", "tethers", "support", "motility", "inner_wall",
        "stiffness_factor", "prestrain", "damping_ratio", "fill", "vessel_segment", "skin", "tear_strain"})
    if (map.has(of_net)) map[of_net].fail("belongs to nets; an object with layers is made of elements");
  if (object.rigid) map["rigid"].fail("must not be true with layers");
  std::uint32_t elements = 0;
  for (const Value& item : map["layers"].list()) {
    Map layer(item);
    Layer result;
    result.material = layer["material"].name();
    result.thickness = within(layer["thickness"], "layers/*/thickness");
    if (layer.has("elements")) result.elements = countWithin(layer["elements"], "layers/*/elements");
    layer.finish();
    elements += result.elements;
    object.layers.push_back(result);
  }
  if (object.layers.empty() || elements > 64) map["layers"].fail("must be layers of 1 to 64 elements in all");
}

TreeSpec treeOf(const Value& value) {
  Map map(value);
  TreeSpec spec;
  const auto letters = [](const Value& word) {
    const std::string signs = word.string();
    if (signs.empty() || signs.size() > 200 ||
        signs.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ[]/") != std::string::npos)
      word.fail("must be 1 to 200 of the letters A to Z (F: a branch), [ ] and /");
    return signs;
  };
  spec.root = map["root"].vector3();
  spec.radius = within(map["radius"], "tree/radius");
  if (map.has("region")) {
    for (const char* key :
         {"direction", "plane", "axiom", "productions", "steps", "length", "turn", "scatter"})
      if (map.has(key)) map[key].fail("must not be there: a tree with a region grows by its terminals");
    const Value all = map["region"];
    Map region(all);
    spec.region = Region{region["centre"].vector3(), region["half_axes"].vector3()};
    for (const Value& item : region["half_axes"].list()) within(item, "tree/region/half_axes/*");
    region.finish();
    spec.terminals = countWithin(map["terminals"], "tree/terminals");
  } else {
    spec.direction = map["direction"].vector3();
    spec.plane = map["plane"].vector3();
    spec.axiom = letters(map["axiom"]);
  }
  if (map.has("productions")) {
    const Value all = map["productions"];  // lives as long as the loop over what it holds
    Map productions(all);
    for (const auto& entry : all.node()) {
      const std::string letter = entry.first.Scalar();
      if (letter.size() != 1 || letter[0] < 'A' || letter[0] > 'Z')
        all.fail("its keys must be one letter each, A to Z");
      spec.productions[letter[0]] = letters(productions[letter]);
    }
    productions.finish();
  }
  if (map.has("steps")) spec.steps = countWithin(map["steps"], "tree/steps");
  if (map.has("seed")) spec.seed = countWithin(map["seed"], "tree/seed");
  if (map.has("length")) spec.length = within(map["length"], "tree/length");
  if (map.has("turn")) spec.turn = within(map["turn"], "tree/turn") * 3.14159265358979323846 / 180;
  if (map.has("scatter")) spec.scatter = within(map["scatter"], "tree/scatter");
  if (map.has("least")) spec.least = within(map["least"], "tree/least");
  if (map.has("around")) spec.around = countWithin(map["around"], "tree/around");
  if (map.has("supply")) spec.supply = map["supply"].name();
  if (map.has("flow")) spec.flow = within(map["flow"], "tree/flow");
  map.finish();
  return spec;
}

// Of all trees that fill a region: seconds (assumed).
constexpr std::size_t kMostTerminals = 400;
// As a scene has; a tree alone may be 400.
constexpr std::size_t kMostObjects = 1000;

void add(ObjectSource object, const Value& value, SceneSource& source) {
  if (source.objects.size() == kMostObjects)
    value.fail("must not be there: with it there are more than " + std::to_string(kMostObjects) +
               " objects, branches of trees among them");
  source.objects.push_back(std::move(object));
}

/// The branches of a tree as tubes, each tied to the one that it leaves. What is said of the tree goes for
/// each of them, but rings that are fixed: those of the first one.
void addBranches(const ObjectSource& like, TreeSource tree, const Value& value, SceneSource& source) {
  constexpr double kJoint = 2.0;  // N/m a knot (assumed)
  constexpr std::size_t kLongest = 40;
  if (tree.name.size() > kLongest)
    value.fail("name: must be at most " + std::to_string(kLongest) + " signs of a tree");
  std::size_t terminals = tree.spec.region ? tree.spec.terminals : 0;
  for (const TreeSource& other : source.trees) terminals += other.spec.region ? other.spec.terminals : 0;
  if (terminals > kMostTerminals)
    value.fail("tree: terminals: " + std::to_string(terminals) +
               " with the trees before it; allowed: " + std::to_string(kMostTerminals));
  try {
    tree.branches = growTree(tree.spec);
  } catch (const std::invalid_argument& error) {
    value.fail("tree: " + std::string(error.what()));
  }
  for (std::size_t i = 0; i < tree.branches.size(); ++i) {
    const TreeBranch& branch = tree.branches[i];
    if (!branch.drawn) continue;
    ObjectSource object = like;
    object.name = branchName(tree.name, i);
    object.key = XXH64(&i, sizeof i, like.key);
    for (const ObjectSource& other : source.objects)
      if (other.name == object.name) value.fail("its branch " + object.name + " must be there once");
    const double length = (branch.to - branch.from).norm(), r = branch.radius;
    TubeSpec& tube = object.tube.emplace();
    tube.centre = {branch.from, branch.to};
    tube.sections = {{0.0, {r}}};
    tube.reference = branch.axis;
    tube.rings = static_cast<std::uint32_t>(std::clamp(std::ceil(length / (1.5 * r)) + 1.0, 4.0, 60.0));
    tube.around = tree.spec.around;
    tube.start_dome = tube.end_dome = std::min(r, 0.3 * length);
    tube.wall_thickness = wallOf(r);
    if (!tree.spec.supply.empty()) object.vessel_segment = object.name;
    for (ConnectRule& rule : object.connections) rule.all_of = tree.name;
    if (branch.parent >= 0) {
      object.fixed.erase(std::remove_if(object.fixed.begin(), object.fixed.end(),
                                        [](const FixRule& rule) { return rule.rings.has_value(); }),
                         object.fixed.end());
      const double before = tree.branches[static_cast<std::size_t>(branch.parent)].radius;
      ConnectRule joint;
      joint.to = branchName(tree.name, static_cast<std::size_t>(branch.parent));
      joint.rings = {0, 1, 1, value.line()};
      joint.per_ring = tree.spec.around;
      joint.within = 3 * before;
      joint.stiffness = kJoint;
      joint.line = value.line();
      object.connections.push_back(joint);
    }
    add(std::move(object), value, source);
  }
  source.trees.push_back(std::move(tree));
}

// The other side of the body: x turned round, left and right exchanged in names.
std::string mirrored(std::string word) {
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"_left", "_right"}, {"_right", "_left"}}) {
    const auto place = word.rfind(from);
    if (place != std::string::npos && place + from.size() == word.size())
      return word.replace(place, from.size(), to);
  }
  return word;
}

void shift(ObjectSource& object, const Vector3& by) {
  object.key = XXH64(by.data(), sizeof(double) * 3, object.key);
  if (object.tube)
    for (auto& p : object.tube->centre) p += by;
  if (object.sheet)
    for (auto& curve : object.sheet->curves)
      for (auto& p : curve) p += by;
  if (object.revolve) object.revolve->origin += by;
  for (auto& bump : object.bumps) bump.at += by;
}

ObjectSource mirrored(ObjectSource object) {
  const auto turn = [](Vector3& p) { p.x() = -p.x(); };
  if (object.tube) {
    for (auto& p : object.tube->centre) turn(p);
    turn(object.tube->reference);
    for (auto& section : object.tube->sections) {
      if (section.radii.size() > 2) std::reverse(section.radii.begin() + 1, section.radii.end());
    }
  }
  if (object.sheet) {
    for (auto& curve : object.sheet->curves)
      for (auto& p : curve) turn(p);
  }
  if (object.revolve) {
    turn(object.revolve->origin);
    turn(object.revolve->axis);
    turn(object.revolve->reference);
  }
  if (object.facing) turn(*object.facing);
  for (auto& bump : object.bumps) {
    turn(bump.at);
    turn(bump.push);
  }
  for (auto& rule : object.fixed) rule.outside = mirrored(rule.outside);
  for (auto& rule : object.connections) rule.to = mirrored(rule.to);
  for (auto& rule : object.lay) rule.on = mirrored(rule.on);
  for (auto& rule : object.clear) rule.of = mirrored(rule.of);
  if (!object.vessel_segment.empty()) object.vessel_segment = mirrored(object.vessel_segment);
  return object;
}

void readRules(Map& map, ObjectSource& object) {
  if (map.has("fixed")) {
    object.fixed.clear();
    for (const Value& item : map["fixed"].list()) {
      Map rule(item);
      FixRule fix;
      fix.line = item.line();
      if (rule.has("rings")) fix.rings = ringsOf(rule["rings"]);
      if (rule.has("outside")) fix.outside = rule["outside"].name();
      if (rule.has("margin")) fix.margin = within(rule["margin"], "fixed/*/margin");
      if (!fix.rings && fix.outside.empty()) item.fail("must have rings or outside");
      rule.finish();
      object.fixed.push_back(fix);
    }
  }
  if (map.has("tethers")) {
    object.tethers.clear();
    for (const Value& item : map["tethers"].list()) {
      Map rule(item);
      object.tethers.push_back({ringsOf(rule["rings"]), within(rule["stiffness"], "tethers/*/stiffness")});
      rule.finish();
    }
  }
  if (map.has("connect")) {
    object.connections.clear();
    for (const Value& item : map["connect"].list()) {
      Map rule(item);
      ConnectRule connect;
      connect.line = item.line();
      connect.to = rule["to"].name();
      connect.rings = ringsOf(rule["rings"]);
      if (rule.has("per_ring")) connect.per_ring = countWithin(rule["per_ring"], "connect/*/per_ring");
      connect.within = within(rule["within"], "connect/*/within");
      connect.stiffness = within(rule["stiffness"], "connect/*/stiffness");
      rule.finish();
      object.connections.push_back(connect);
    }
  }
  if (map.has("lay")) {
    object.lay.clear();
    for (const Value& item : map["lay"].list()) {
      Map rule(item);
      object.lay.push_back(
          {rule["on"].name(), ringsOf(rule["rings"]), within(rule["gap"], "lay/*/gap"), item.line()});
      rule.finish();
    }
  }
  if (map.has("clear")) {
    object.clear.clear();
    for (const Value& item : map["clear"].list()) {
      Map rule(item);
      object.clear.push_back({rule["of"].name(), within(rule["gap"], "clear/*/gap"), item.line()});
      rule.finish();
    }
  }
}

/// Hash of what a part of the file says, whatever its layout.
std::uint64_t keyOf(const YAML::Node& node, std::uint64_t seed) {
  const auto word = [&](const std::string& text) { seed = XXH64(text.data(), text.size(), seed + 1); };
  if (node.IsScalar()) {
    word(node.Scalar());
  } else if (node.IsMap()) {
    word("{" + std::to_string(node.size()));
    for (const auto& entry : node) seed = keyOf(entry.second, keyOf(entry.first, seed));
  } else {
    word("[" + std::to_string(node.size()));
    for (const auto& item : node) seed = keyOf(item, seed);
  }
  return seed;
}

void readObject(const Value& value, SceneSource& source) {
  const std::vector<ObjectSource>& before = source.objects;
  Map map(value);
  ObjectSource object;
  const bool mirror = map.has("mirror_of");
  if (mirror) {
    const Value other = map["mirror_of"];
    const auto found = std::find_if(before.begin(), before.end(),
                                    [&](const ObjectSource& o) { return o.name == other.string(); });
    if (found == before.end()) other.fail("must be an object above");
    object = mirrored(*found);
  }
  object.key = keyOf(value.node(), object.key);
  object.file = value.file();
  object.line[""] = value.line();
  for (const auto& entry : value.node()) object.line[entry.first.Scalar()] = entry.second.Mark().line + 1;
  object.name = map["name"].name();
  for (const auto& other : before)
    if (other.name == object.name) map["name"].fail("must be there once");
  const auto needed = [&](const char* key) { return !mirror || map.has(key); };
  if (needed("organ")) object.organ = map["organ"].name();
  if (needed("material")) object.material = map["material"].name();
  if (map.has("roles")) {
    object.roles.clear();
    for (const Value& role : map["roles"].list()) object.roles.push_back(role.name());
  }
  if (map.has("rigid")) object.rigid = map["rigid"].boolean();
  if (map.has("full_contact")) object.full_contact = map["full_contact"].boolean();
  if (map.has("tube")) object.tube = tubeOf(map["tube"]);
  if (map.has("sheet")) object.sheet = sheetOf(map["sheet"]);
  if (map.has("revolve")) object.revolve = revolveOf(map["revolve"]);
  std::optional<TreeSource> tree;
  if (map.has("tree")) {
    if (mirror || object.rigid) value.fail("tree: must be neither mirror_of another nor rigid");
    tree = TreeSource{object.name, object.material, treeOf(map["tree"]), {}};
  }
  if (object.tube.has_value() + object.sheet.has_value() + object.revolve.has_value() + tree.has_value() != 1)
    value.fail("must have either tube, sheet, revolve or tree");
  if (map.has("layers")) {
    if (mirror || tree || object.sheet) map["layers"].fail("belongs to tube and revolve, without mirror_of");
    readLayers(map, object);
  }
  if (map.has("bumps")) {
    object.bumps.clear();
    for (const Value& item : map["bumps"].list()) {
      Map bump(item);
      object.bumps.push_back({bump["at"].vector3(), bump["size"].vector3(), bump["push"].vector3()});
      if (!(object.bumps.back().size.minCoeff() > 0)) item.fail("size must be > 0");
      bump.finish();
    }
  }
  if (!object.rigid && map.has("springs")) object.springs = countWithin(map["springs"], "springs");
  if (map.has("fillers")) {
    object.fillers.clear();
    for (const Value& item : map["fillers"].list()) {
      const std::string word = item.oneOf(kLinkWords);
      object.fillers.push_back(kLinkClasses[static_cast<std::size_t>(
          std::find(kLinkWords.begin(), kLinkWords.end(), word) - kLinkWords.begin())]);
    }
  } else if (!mirror && object.springs == 0) {
    object.fillers =
        object.sheet ? std::vector{LinkClass::Leaf, LinkClass::Cross} : std::vector{LinkClass::Ring2};
  }
  if (map.has("skin")) {
    Map skin(map["skin"]);
    object.skin_along = countWithin(skin["along"], "skin/along");
    object.skin_around = countWithin(skin["around"], "skin/around");
    if (skin.has("petals")) object.petals = countWithin(skin["petals"], "skin/petals");
    if (skin.has("petal_depth")) object.petal_depth = within(skin["petal_depth"], "skin/petal_depth");
    if (skin.has("facing")) {
      object.facing = skin["facing"].vector3();
      if (!(object.facing->norm() > 0)) skin["facing"].fail("must not be zero");
      if (!object.layers.empty()) skin["facing"].fail("belongs to nets, without layers");
    }
    skin.finish();
  }
  const auto number = [&](const char* key, auto& target) {
    if (map.has(key)) target = within(map[key], key);
  };
  number("fill", object.fill);
  number("stiffness_factor", object.stiffness_factor);
  number("prestrain", object.prestrain);
  number("damping_ratio", object.damping_ratio);
  number("damping_rate", object.damping_rate);
  number("support", object.support);
  number("bulk_modulus", object.bulk_modulus);
  number("contact_thickness", object.contact_thickness);
  number("puncture_force", object.puncture_force);
  number("friction", object.friction);
  number("cut_toughness", object.cut_toughness);
  number("tear_strain", object.tear_strain);
  number("grasp_damage_threshold", object.grasp_damage_threshold);
  number("inner_wall", object.inner_wall);
  if (map.has("motility")) object.motility = scene::readMotility(map["motility"]);
  if (map.has("vessel_segment")) object.vessel_segment = map["vessel_segment"].name();
  if (tree && !object.vessel_segment.empty())
    value.fail("vessel_segment: must not be there: a tree's branches are segments of its own network");
  readRules(map, object);
  map.finish();
  if (tree)
    addBranches(object, std::move(*tree), value, source);
  else
    add(std::move(object), value, source);
}

std::string directoryOf(const std::string& path) {
  const auto slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash);
}

// Beside the material database: data/parts/NAME.yaml.
std::string shippedPart(const Value& name) {
  const std::string folder = directoryOf(material::databasePath()) + "/parts";
  std::set<std::string> known;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none))
    if (entry.path().extension() == ".yaml") known.insert(entry.path().stem().string());
  if (known.count(name.name())) return folder + "/" + name.name() + ".yaml";
  std::string allowed;
  for (const std::string& word : known) allowed += (allowed.empty() ? "" : ", ") + word;
  name.fail("must be a part that VEST ships: " + allowed);
}

/// @param bytes of all parts so far
void include(const Value& value, SceneSource& source, std::size_t& bytes) {
  Map map(value);
  const bool shipped = map.has("part"), own = map.has("file");
  if (shipped == own) value.fail("must have either part (one that VEST ships) or file (one of your own)");
  std::string path;
  if (own) {
    const Value file = map["file"];
    path = scene::yaml::resolve(directoryOf(value.file()), file.string(), file.file(), file.line(),
                                file.field());
    source.parts.push_back(file.string());
  } else {
    path = shippedPart(map["part"]);
  }
  const Vector3 by = map.has("shift") ? map["shift"].vector3() : Vector3::Zero();
  map.finish();
  const std::string text = scene::yaml::readFile(path, scene::yaml::kMaxBytes);
  constexpr std::size_t kMost = 16u << 20;  // assumed: a second or two
  bytes += text.size();
  if (bytes > kMost)
    value.fail("with it the parts have " + std::to_string(bytes) +
               " bytes; allowed: " + std::to_string(kMost));
  const Value root = scene::yaml::parse(path, text);
  Map part(root);
  part["vest_part"].integer(1, 1);
  for (const Value& item : part["objects"].list()) {
    const std::size_t first = source.objects.size(), trees = source.trees.size();
    readObject(item, source);
    for (std::size_t i = first; i < source.objects.size(); ++i) shift(source.objects[i], by);
    for (std::size_t i = trees; i < source.trees.size(); ++i)
      for (TreeBranch& branch : source.trees[i].branches) branch.from += by, branch.to += by;
  }
  part.finish();
}

}  // namespace

SceneSource readAlone(const std::string& text) {
  SceneSource source;
  readObject(scene::yaml::parse("object", text), source);
  return source;
}

SceneSource readSource(const std::string& path) {
  return readSource(path, scene::yaml::readFile(path, scene::yaml::kMaxBytes));
}

SceneSource readSource(const std::string& path, const std::string& text) {
  const Value root = scene::yaml::parse(path, text);
  Map map(root);
  SceneSource source;
  map["vest_source"].integer(1, 1);
  source.name = map["name"].name();
  if (map.has("gravity")) source.gravity = map["gravity"].vector3();
  if (map.has("dt")) source.dt = map["dt"].number(1e-6, 0.01);
  if (map.has("seed")) source.seed = map["seed"].integer(0, 4294967295u);
  std::size_t bytes = 0;
  if (map.has("objects") || !map.has("include"))
    for (const Value& item : map["objects"].list()) readObject(item, source);
  if (map.has("include"))
    for (const Value& item : map["include"].list()) include(item, source, bytes);
  if (map.has("sutures")) {
    std::vector<std::string> taken;
    for (const ObjectSource& o : source.objects) taken.push_back(o.name);
    source.sutures =
        scene::readSutures(map["sutures"], material::readSutures(material::suturesPath()), taken);
  }
  map.finish();
  return source;
}

Materials readMaterials(const std::string& path) {
  Materials materials;
  for (material::Tissue& tissue : material::readDatabase(path).tissues)
    materials.emplace(tissue.name, std::move(tissue));
  return materials;
}

}  // namespace vest::modelling

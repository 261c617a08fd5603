#include "vest_tissue/modelling/fields.h"

#include <cstdio>
#include <limits>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::modelling {
namespace {

using FieldKind = Field::Kind;
using Node = Document::Node;

constexpr double kMetres = 10.0;  // nothing in a body scene is larger
constexpr double kAny = 1e9;
constexpr double kNoEnd = std::numeric_limits<double>::infinity();

bool matches(const std::string& pattern, const std::string& path) {
  std::size_t p = 0, s = 0;
  while (p < pattern.size() && s < path.size()) {
    if (pattern[p] == '*') {
      if (path[s] < '0' || path[s] > '9') return false;
      while (s < path.size() && path[s] >= '0' && path[s] <= '9') ++s;
      ++p;
    } else if (pattern[p++] != path[s++]) {
      return false;
    }
  }
  return p == pattern.size() && s == path.size();
}

const Node* child(const Node& map, const std::string& key) {
  for (std::size_t i = 0; i < map.names.size(); ++i)
    if (map.names[i] == key) return &map.children[i];
  return nullptr;
}

/// A list that is edited in one piece: of words or numbers, such as a point or the roles.
bool together(const Node& node) {
  for (const Node& item : node.children)
    if (item.kind != Node::Kind::Scalar) return false;
  return node.kind == Node::Kind::List;
}

void addEntries(const Document& document, const Node& node, const std::string& path,
                std::vector<Entry>& entries) {
  if (node.kind == Node::Kind::Scalar || together(node)) {
    entries.push_back(
        {path, inOneLine(document.text().substr(node.begin, node.end - node.begin)), fieldOf(path)});
    return;
  }
  const std::string before = path.empty() ? "" : path + "/";
  for (std::size_t i = 0; i < node.children.size(); ++i)
    addEntries(document, node.children[i], before + (node.names.empty() ? std::to_string(i) : node.names[i]),
               entries);
}

}  // namespace

const std::vector<Field>& fields() {
  static const std::vector<Field> all = {
      {FieldKind::Word, "name", "", 0, 0, "letters, digits, _ . -; once in the source"},
      {FieldKind::Word, "organ", "", 0, 0, "chooses the look and what people call it"},
      {FieldKind::Word, "material", "", 0, 0, "one of vest_material list"},
      {FieldKind::Word, "roles", "", 0, 0, "list of words for exercises, such as target"},
      {FieldKind::Word, "rigid", "", 0, 0, "true or false"},
      {FieldKind::Word, "mirror_of", "", 0, 0, "an object above it"},
      {FieldKind::Vector, "tube/centre/*", "m", -kAny, kAny, "control point of the centre curve"},
      {FieldKind::Number, "tube/sections/*/at", "", 0, 1,
       "place of the cross-section, fraction of the length"},
      {FieldKind::Number, "tube/sections/*/radii/*", "m", 1e-5, kMetres,
       "1 radius: circle, 2: ellipse, 4 and more: closed spline"},
      {FieldKind::Vector, "tube/reference", "", -kAny, kAny, "direction of angle 0"},
      {FieldKind::Whole, "tube/rings", "", 3, 1000, "knots along it"},
      {FieldKind::Whole, "tube/around", "", 4, 200, "knots round it"},
      {FieldKind::Word, "tube/start", "", 0, 0, "pole or cap"},
      {FieldKind::Word, "tube/end", "", 0, 0, "pole or cap"},
      {FieldKind::Number, "tube/start_dome", "m", 0, kMetres, "length over which the end is rounded off"},
      {FieldKind::Number, "tube/end_dome", "m", 0, kMetres, "length over which the end is rounded off"},
      {FieldKind::Number, "tube/start_mouth", "m", 0, kMetres, "depth of the pole inside: a funnel"},
      {FieldKind::Number, "tube/end_mouth", "m", 0, kMetres, "depth of the pole inside: a funnel"},
      {FieldKind::Number, "tube/wall_thickness", "m", 0, kMetres, "0: solid"},
      {FieldKind::Vector, "sheet/curves/*/*", "m", -kAny, kAny, "control point, upper to lower edge"},
      {FieldKind::Whole, "sheet/stations", "", 3, 1000, "knots along it"},
      {FieldKind::Whole, "sheet/height_knots", "", 3, 100, "knots from edge to edge, of each leaf"},
      {FieldKind::Positive, "sheet/thickness", "m", 0, kNoEnd, "of both leaves together"},
      {FieldKind::Vector, "revolve/origin", "m", -kAny, kAny, "where the profile's height is 0"},
      {FieldKind::Vector, "revolve/axis", "", -kAny, kAny, "direction, of any length"},
      {FieldKind::Vector, "revolve/reference", "", -kAny, kAny, "direction of angle 0"},
      {FieldKind::Vector, "revolve/profile/*", "m", -kMetres, kMetres, "[height along the axis, radius]"},
      {FieldKind::Number, "revolve/profile/*/0", "m", -kMetres, kMetres, "height along the axis"},
      {FieldKind::Number, "revolve/profile/*/1", "m", 0, kMetres, "radius"},
      {FieldKind::Whole, "revolve/rings", "", 3, 1000, "knots along it"},
      {FieldKind::Whole, "revolve/around", "", 4, 200, "knots round it"},
      {FieldKind::Number, "revolve/wall_thickness", "m", 0, kMetres, "0: solid"},
      {FieldKind::Vector, "tree/root", "m", -kAny, kAny, "where the first branch begins"},
      {FieldKind::Vector, "tree/direction", "", -kAny, kAny, "of the first branch"},
      {FieldKind::Vector, "tree/plane", "", -kAny, kAny, "the first branching lies in direction and this"},
      {FieldKind::Number, "tree/radius", "m", 1e-4, 0.02, "of the first branch"},
      {FieldKind::Word, "tree/axiom", "", 0, 0, "the word that grows: A to Z (F: a branch), [ ] and /"},
      {FieldKind::Whole, "tree/steps", "", 0, 12, "of growth"},
      {FieldKind::Whole, "tree/seed", "", 0, 4294967295.0, "of the scatter"},
      {FieldKind::Number, "tree/length", "", 2, 100, "of a branch over its radius"},
      {FieldKind::Number, "tree/turn", "degrees", -360, 360,
       "by which a / turns the plane of the next branching"},
      {FieldKind::Number, "tree/scatter", "", 0, 0.5, "share by which lengths and angles vary"},
      {FieldKind::Number, "tree/least", "m", 5e-5, 0.02, "thinner branches are not drawn"},
      {FieldKind::Whole, "tree/around", "", 4, 24, "knots round a branch"},
      {FieldKind::Vector, "tree/region/centre", "m", -kAny, kAny, "of the ellipsoid that the tree supplies"},
      {FieldKind::Vector, "tree/region/half_axes", "m", 1e-4, 1, "of the ellipsoid, along x, y and z"},
      {FieldKind::Number, "tree/region/half_axes/*", "m", 1e-4, 1, "along x, y or z"},
      {FieldKind::Whole, "tree/terminals", "", 1, 200, "ends, spread over the region"},
      {FieldKind::Word, "tree/supply", "", 0, 0, "artery of the patient at whose end it begins"},
      {FieldKind::Number, "tree/flow", "m³/s", 1e-12, 1e-3, "for trials of the tree alone"},
      {FieldKind::Word, "layers/*/material", "", 0, 0, "one of vest_material list"},
      {FieldKind::Number, "layers/*/thickness", "m", 1e-5, 1, "of the layer"},
      {FieldKind::Whole, "layers/*/elements", "", 1, 32, "across the layer"},
      {FieldKind::Vector, "bumps/*/at", "m", -kAny, kAny, "knots near it move"},
      {FieldKind::Vector, "bumps/*/size", "m", 0, kAny, "standard deviations"},
      {FieldKind::Vector, "bumps/*/push", "m", -kAny, kAny, "by which they move at most"},
      {FieldKind::Whole, "springs", "", 1, 1000000, "exact number of links"},
      {FieldKind::Whole, "skin/along", "", 1, 16, "pieces of a knot interval"},
      {FieldKind::Whole, "skin/around", "", 1, 16, "pieces of a knot interval"},
      {FieldKind::Whole, "skin/petals", "", 0, 64, "fringes of a funnel"},
      {FieldKind::Number, "skin/petal_depth", "", 0, 1, "of the fringes"},
      {FieldKind::Vector, "skin/facing", "", -kAny, kAny,
       "spreads the texture round the part that lies there"},
      {FieldKind::Number, "fill", "", 0.01, 1, "part of the volume that weighs"},
      {FieldKind::Number, "stiffness_factor", "", 1e-4, 1e4, "on all areas of links"},
      {FieldKind::Number, "prestrain", "", 0, 0.5, "stretch of all links as they are placed"},
      {FieldKind::Number, "damping_ratio", "", 0, 2, "of each link's critical damping"},
      {FieldKind::Number, "damping_rate", "1/s", 0, 1000, "in proportion to mass"},
      {FieldKind::Number, "support", "rad/s", 0, 1000, "surroundings that carry the weight; 0: none"},
      {FieldKind::Number, "bulk_modulus", "Pa", 0, 1e9, "of the volume element; 0: none"},
      {FieldKind::Number, "friction", "", 0, 2, "Coulomb"},
      {FieldKind::Number, "contact_thickness", "m", 0, 0.1, "distance that contacts keep"},
      {FieldKind::Number, "cut_toughness", "J/m²", 0, 1e6, "work of a cut"},
      {FieldKind::Number, "puncture_force", "N", 0, 1e3, "of a needle"},
      {FieldKind::Number, "tear_strain", "", 0, 1e3, "stretch at which links part; 0: never"},
      {FieldKind::Number, "grasp_damage_threshold", "Pa", 0, 1e9, "pinch that destroys with time; 0: never"},
      {FieldKind::Number, "inner_wall", "m", 0, 0.1, "wall that a cut shows; 0: that of the tube"},
      {FieldKind::Number, "fixed/*/margin", "m", -kMetres, kMetres, "from the cavity's surface"},
      {FieldKind::Positive, "tethers/*/stiffness", "N/m", 0, kNoEnd, "a knot"},
      {FieldKind::Whole, "connect/*/per_ring", "", 1, 100, "knots of each ring, nearest first"},
      {FieldKind::Positive, "connect/*/within", "m", 0, kNoEnd, "farther knots stay free"},
      {FieldKind::Positive, "connect/*/stiffness", "N/m", 0, kNoEnd, "a knot"},
      {FieldKind::Number, "lay/*/gap", "m", -kMetres, kMetres, "of the centres, outside the other surface"},
      {FieldKind::Number, "clear/*/gap", "m", 0, kMetres, "between the surfaces"},
  };
  return all;
}

const Field* fieldOf(const std::string& path) {
  for (const Field& field : fields())
    if (path == field.path || matches(field.path, path)) return &field;
  // A list of numbers goes by its items.
  for (const Field& field : fields())
    if (field.kind != FieldKind::Word && matches(field.path, path + "/0")) return &field;
  return nullptr;
}

std::string allowedText(const Field& field) {
  char text[80];
  switch (field.kind) {
    case FieldKind::Word:
    case FieldKind::Vector:
      return "";
    case FieldKind::Positive:
      return "> 0";
    case FieldKind::Number:
    case FieldKind::Whole:
      break;
  }
  std::snprintf(text, sizeof text, "%s%.10g … %.10g", field.kind == FieldKind::Whole ? "whole, " : "",
                field.least, field.most);
  return text;
}

std::vector<Entry> entriesOf(const Document& document, const std::string& object) {
  const Node* list = child(document.root(), "objects");
  for (std::size_t i = 0; list != nullptr && i < list->children.size(); ++i) {
    const Node& node = list->children[i];
    const Node* name = child(node, "name");
    if (name == nullptr || name->word != object) continue;
    std::vector<Entry> entries;
    addEntries(document, node, "", entries);
    for (const Field& field : fields()) {
      const std::string path = field.path;
      if (field.kind == FieldKind::Word || path.find('*') != std::string::npos) continue;
      // Of a shape or group that the object has, or of the object itself.
      const Node* of = &node;
      std::size_t begin = 0;
      for (std::size_t slash; of != nullptr && (slash = path.find('/', begin)) != std::string::npos;
           begin = slash + 1)
        of = child(*of, path.substr(begin, slash - begin));
      if (of == nullptr || child(*of, path.substr(begin)) != nullptr) continue;
      entries.push_back({path, "", &field});
    }
    return entries;
  }
  throw std::invalid_argument(files::shown(object) + ": no object of the source itself");
}

std::vector<ObjectLine> objectsOf(const Document& document) {
  std::vector<ObjectLine> lines;
  const Node* list = child(document.root(), "objects");
  for (std::size_t i = 0; list != nullptr && i < list->children.size(); ++i) {
    const Node& node = list->children[i];
    const auto word = [&](const char* key) {
      const Node* found = child(node, key);
      return found == nullptr ? std::string() : found->word;
    };
    ObjectLine line{word("name"), "", word("organ"), word("material")};
    for (const char* shape : {"tube", "sheet", "revolve", "tree"})
      if (child(node, shape) != nullptr) line.kind = shape;
    if (line.kind.empty()) line.kind = "mirror of " + word("mirror_of");
    lines.push_back(line);
  }
  return lines;
}

}  // namespace vest::modelling

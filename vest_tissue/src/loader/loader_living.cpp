#include "loader_living.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>

#include "vest_tissue/base/nearest.h"

namespace vest::scene {
namespace {

using yaml::Map;
using yaml::Value;

constexpr std::size_t kMostPairs = 300000000;  // a second (assumed)

void readWave(const Value& value, motility::Wave& w) {
  Map map(value);
  const auto number = [&](const char* key, double& target, double least, double most) {
    if (map.has(key)) target = map[key].number(least, most);
  };
  number("pressure", w.pressure, 0, 1e5);
  number("pressure_scatter", w.pressure_scatter, 0, 1e5);
  number("waves", w.waves, 0, 1000);
  number("direction", w.direction, -1, 1);
  number("frequency", w.frequency, 0, 100);
  number("frequency_scatter", w.frequency_scatter, 0, 100);
  map.finish();
}

}  // namespace

motility::Motility readMotility(const Value& value) {
  Map map(value);
  motility::Motility m;
  if (map.has("preset")) {
    const std::vector<std::string> words(motility::kPresets.begin(), motility::kPresets.end());
    motility::preset(map["preset"].oneOf(words), m);
  }
  if (map.has("radial")) readWave(map["radial"], m.waves[0]);
  if (map.has("axial")) readWave(map["axial"], m.waves[1]);
  if (map.has("ramp")) m.ramp = map["ramp"].number(0, 1e6);
  map.finish();
  return m;
}

std::string motilityText(const motility::Motility& m) {
  if (!m.active()) return "";
  std::string out = "{";
  const char* const names[] = {"radial", "axial"};
  for (std::size_t i = 0; i < 2; ++i) {
    const motility::Wave& w = m.waves[i];
    if (w.pressure == 0.0) continue;
    char text[300];
    std::snprintf(text, sizeof text,
                  "%s: {pressure: %.10g, pressure_scatter: %.10g, waves: %.10g, direction: %.10g, frequency: "
                  "%.10g, frequency_scatter: %.10g}, ",
                  names[i], w.pressure, w.pressure_scatter, w.waves, w.direction, w.frequency,
                  w.frequency_scatter);
    out += text;
  }
  char ramp[40];
  std::snprintf(ramp, sizeof ramp, "ramp: %.10g}", m.ramp);
  return out + ramp;
}

std::string livingText(const Object& object) {
  const auto& t = object.thermal;
  char text[400];
  std::snprintf(text, sizeof text, "    friction: %.10g\n", object.friction);
  std::string out = text;
  if (object.model != ObjectModel::Rigid) {
    std::snprintf(text, sizeof text,
                  "    cut_toughness: %.10g\n    tear_strain: %.10g\n    grasp_damage_threshold: %.10g\n",
                  object.cut_toughness, object.tear_strain, object.grasp_damage_threshold);
    out += text;
  }
  std::snprintf(text, sizeof text,
                "    thermal: {heat_capacity: %.10g, conductivity: %.10g, perfusion: %.10g, water: %.10g}\n",
                t.heat_capacity, t.conductivity, t.perfusion, t.water);
  return out + text;
}

void readLiving(Map& map, Object& object) {
  if (map.has("friction")) object.friction = map["friction"].number(0, 2);
  if (map.has("tear_strain")) object.tear_strain = map["tear_strain"].number(0, 1e3);
  if (map.has("cut_toughness")) object.cut_toughness = map["cut_toughness"].number(0, 1e6);
  if (map.has("grasp_damage_threshold"))
    object.grasp_damage_threshold = map["grasp_damage_threshold"].number(0, 1e9);
  if (map.has("thermal")) {
    Map thermal(map["thermal"]);
    auto& t = object.thermal;
    if (thermal.has("heat_capacity")) t.heat_capacity = thermal["heat_capacity"].number(100, 10000);
    if (thermal.has("conductivity")) t.conductivity = thermal["conductivity"].number(0, 100);
    if (thermal.has("perfusion")) t.perfusion = thermal["perfusion"].number(0, 1);
    if (thermal.has("water")) t.water = thermal["water"].number(0, 1);
    thermal.finish();
  }
  if (!map.has("motility")) return;
  if (object.model != ObjectModel::Net) map["motility"].fail("belongs to objects with model: net");
  object.motility = readMotility(map["motility"]);
}

void readNearestConnections(const Value& value, Description& description) {
  std::size_t work = 0;
  for (const Value& item : value.list()) {
    Map map(item);
    const auto names = map["objects"].list();
    if (names.size() != 2) map["objects"].fail("must be two objects of the scene: [FROM, TO]");
    std::array<std::size_t, 2> index{};
    for (std::size_t n = 0; n < 2; ++n) {
      while (index[n] < description.objects.size() && description.objects[index[n]].name != names[n].string())
        ++index[n];
      if (index[n] == description.objects.size()) names[n].fail("must be an object of the scene");
    }
    if (index[0] == index[1]) names[1].fail("must be another object than the first");
    const Object &from = description.objects[index[0]], &to = description.objects[index[1]];
    if (to.contact_triangles.empty()) names[1].fail("must be an object with triangles");
    const double within = map["within"].positive();
    Connection c;
    c.object0 = from.name, c.object1 = to.name;
    c.stiffness = map["stiffness"].positive();
    if (map.has("damping")) c.damping = map["damping"].number(0, 1e9);
    if (map.has("break_force")) c.break_force = map["break_force"].number(0, 1e9);
    const std::size_t most = map.has("most") ? map["most"].integer(1, 1000000) : 1000000;
    map.finish();
    work += from.position.size() * to.contact_triangles.size();
    if (work > kMostPairs)
      item.fail("must look at no more than " + std::to_string(kMostPairs) +
                " pairs of a knot and a triangle, with those above it");
    // Nearest first, so that `most` keeps the closest; equal distances by knot.
    std::vector<std::pair<double, Connection>> found;
    for (std::size_t k = 0; k < from.position.size(); ++k) {
      double best = std::numeric_limits<double>::infinity();
      for (const auto& t : to.contact_triangles) {
        const auto& x = to.position;
        const Eigen::Vector3d off =
            (x[t[0]].cwiseMin(x[t[1]]).cwiseMin(x[t[2]]) - from.position[k])
                .cwiseMax(from.position[k] - x[t[0]].cwiseMax(x[t[1]]).cwiseMax(x[t[2]]));
        if (off.maxCoeff() > std::min(best, within)) continue;  // nothing of it is so near
        const contact::Nearest n =
            contact::nearest(from.position[k], {to.position[t[0]], to.position[t[1]], to.position[t[2]]});
        if (!(n.distance < best)) continue;
        best = n.distance;
        c.knot0 = static_cast<Index>(k);
        c.triangle1 = t;
        c.weights1 = n.weights;
      }
      if (!(best <= within)) continue;
      Eigen::Vector3d place = Eigen::Vector3d::Zero();
      for (int i = 0; i < 3; ++i) place += c.weights1[i] * to.position[c.triangle1[i]];
      c.offset = from.position[k] - place;
      found.emplace_back(best, c);
    }
    if (found.empty()) item.fail("must tie at least one knot: none of the first lies `within` of the second");
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    if (found.size() > most) found.resize(most);
    for (auto& [distance, connection] : found) description.connections.push_back(std::move(connection));
  }
}

}  // namespace vest::scene

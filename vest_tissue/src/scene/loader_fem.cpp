#include "loader_fem.h"

#include <limits>

#include "csv_reader.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/scene/fem_object.h"

namespace vest::scene {
namespace {

using yaml::Map;
using yaml::Value;

Eigen::Vector3d vectorOf(const csv::Table& table, std::size_t row, const char* const (&names)[3]) {
  Eigen::Vector3d v;
  for (int k = 0; k < 3; ++k) v[k] = table.rows[row][static_cast<std::size_t>(table.column(names[k]))];
  return v;
}

fem::Material readMaterial(const Value& value) {
  constexpr double kMost = std::numeric_limits<double>::max();
  Map map(value);
  fem::Material m;
  m.youngs_modulus = map["youngs_modulus"].positive();
  m.poisson_ratio = map["poisson_ratio"].number(-1.0, 0.5);
  if (m.poisson_ratio <= -1.0 || m.poisson_ratio >= 0.5)
    map["poisson_ratio"].fail("must be above -1 and below 0.5");
  if (map.has("density")) m.density = map["density"].number(0.0, kMost);
  if (map.has("rayleigh_mass")) m.rayleigh_mass = map["rayleigh_mass"].number(0.0, kMost);
  if (map.has("rayleigh_stiffness")) m.rayleigh_stiffness = map["rayleigh_stiffness"].number(0.0, kMost);
  map.finish();
  return m;
}

}  // namespace

void readFem(Map& map, const std::function<std::string(const Value&, std::string&)>& read, Object& object) {
  auto d = std::make_shared<fem::Description>();
  d->name = object.name;
  if (map.has("strain")) {
    d->strain = map["strain"].oneOf({"small", "corotational"}) == "small" ? fem::Strain::Small
                                                                          : fem::Strain::Corotational;
  }
  if (map.has("integrator")) {
    d->motion = map["integrator"].oneOf({"backward_euler", "elastostatic"}) == "elastostatic"
                    ? fem::Motion::Elastostatic
                    : fem::Motion::BackwardEuler;
    if (d->motion == fem::Motion::Elastostatic && d->strain == fem::Strain::Corotational)
      map["integrator"].fail("must be backward_euler with strain: corotational");
  }
  d->material = readMaterial(map["material"]);
  std::string path;
  const auto table = [&](const char* key, const std::vector<std::string>& columns) {
    const std::string bytes = read(map[key], path);
    return csv::read(path, bytes, columns, {});
  };
  const csv::Table nodes = table("nodes", {"node", "x", "y", "z"});
  if (nodes.rows.empty()) yaml::fail(path, 0, "rows", "none", "must have at least one node");
  const std::size_t most = nodes.rows.size() - 1;
  d->nodes.resize(nodes.rows.size());
  std::vector<bool> seen(nodes.rows.size(), false);
  for (std::size_t i = 0; i < nodes.rows.size(); ++i) {
    const std::size_t node = nodes.index(i, "node", most);
    if (seen[node]) yaml::fail(path, nodes.lines[i], "node", std::to_string(node), "must be there once");
    seen[node] = true;
    d->nodes[node] = vectorOf(nodes, i, {"x", "y", "z"});
  }
  const csv::Table tetrahedra = table("tetrahedra", {"n0", "n1", "n2", "n3"});
  for (std::size_t i = 0; i < tetrahedra.rows.size(); ++i) {
    std::array<fem::Index, 4> t{};
    const char* const names[] = {"n0", "n1", "n2", "n3"};
    for (std::size_t k = 0; k < 4; ++k) t[k] = static_cast<fem::Index>(tetrahedra.index(i, names[k], most));
    d->tetrahedra.push_back(t);
  }
  if (map.has("fixed")) {
    const csv::Table fixed = table("fixed", {"node"});
    for (std::size_t i = 0; i < fixed.rows.size(); ++i) {
      d->fixed.push_back(static_cast<fem::Index>(fixed.index(i, "node", most)));
    }
  }
  if (map.has("loads")) {
    const csv::Table loads = table("loads", {"node", "fx", "fy", "fz"});
    for (std::size_t i = 0; i < loads.rows.size(); ++i) {
      d->loads.push_back(
          {static_cast<fem::Index>(loads.index(i, "node", most)), vectorOf(loads, i, {"fx", "fy", "fz"})});
    }
  }
  object.fem = std::move(d);
  completeFem(object);
}

}  // namespace vest::scene

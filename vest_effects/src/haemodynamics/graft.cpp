#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "vest_effects/haemodynamics/model.h"
#include "vest_effects/haemodynamics/vessels.h"

namespace vest::haemodynamics {

namespace {

constexpr double kPi = 3.14159265358979323846;
// What a scene's own vessels may cost: pulse waves take steps of a cell's length over their speed (assumed).
constexpr std::size_t kMostSegments = 1000;
constexpr double kShortest = 5e-4, kFastest = 50;  // m, m/s

void checkCost(const Network& tree) {
  if (tree.segments.size() > kMostSegments)
    throw NetworkError(tree.network_file, 0, "rows", std::to_string(tree.segments.size()),
                       "at most " + std::to_string(kMostSegments) + " in a scene");
  for (const SegmentSpec& s : tree.segments) {
    if (!(s.length >= kShortest))
      throw NetworkError(tree.network_file, s.line, "length_m", formatNumber(s.length),
                         ">= 0.0005 in a scene");
    for (const auto& [wall, radius] :
         {std::pair{s.wall_proximal, s.radius_proximal}, {s.wall_distal, s.radius_distal}}) {
      const double speed = std::sqrt(2.0 / 3.0 * s.youngs_modulus * wall / (tree.density * radius));
      if (!(speed <= kFastest))
        throw NetworkError(tree.network_file, s.line, "E_Pa", formatNumber(s.youngs_modulus),
                           "a wall whose waves are not faster than 50 m/s, in a scene");
    }
  }
}

/// Pa·s/m³ of steady flow through a segment: f = -2(zeta + 2) mu pi U over a linear taper.
double resistanceOf(const Network& network, const SegmentSpec& s) {
  const double a = s.radius_proximal, b = s.radius_distal;
  const double mean = (a * a + a * b + b * b) / (3 * a * a * a * b * b * b);  // of 1/r^4 along the taper
  return 2 * (network.profile + 2) * network.viscosity * s.length * mean / kPi;
}

/// Pa·s/m³ from a node of a tree to the air, its ends' loads scaled.
double resistanceBehind(const Network& blood, const Network& tree,
                        const std::map<long, std::vector<int>>& leaving, long node, double scale) {
  double conductance = 0;
  for (const int i : leaving.at(node)) {
    const SegmentSpec& s = tree.segments[static_cast<std::size_t>(i)];
    const double behind = s.terminal ? scale * (s.load.proximal_resistance + s.load.distal_resistance)
                                     : resistanceBehind(blood, tree, leaving, s.node_out, scale);
    conductance += 1 / (resistanceOf(blood, s) + behind);
  }
  return 1 / conductance;
}

}  // namespace

void graft(const Network& tree, const std::string& supply, Vessels& patient) {
  Network& network = patient.network;
  const auto found = std::find_if(network.segments.begin(), network.segments.end(),
                                  [&](const SegmentSpec& s) { return s.name == supply; });
  if (found == network.segments.end())
    throw NetworkError(tree.network_file, 0, "supply", supply, "an artery of " + network.network_file);
  const std::size_t fed = static_cast<std::size_t>(found - network.segments.begin());
  checkCost(tree);
  buildModel(tree, 0.01);  // refuses what is no network

  std::map<long, std::vector<int>> leaving;
  std::set<long> reached;
  for (std::size_t i = 0; i < tree.segments.size(); ++i) {
    const SegmentSpec& s = tree.segments[i];
    leaving[s.node_in].push_back(static_cast<int>(i));
    if (!reached.insert(s.node_out).second)
      throw NetworkError(tree.network_file, s.line, "node_out", std::to_string(s.node_out),
                         "a tree: one segment ends at each node");
  }
  long root = 0;
  for (const auto& [node, segments] : leaving)
    if (!reached.count(node)) root = node;

  double scale = 1;
  if (network.segments[fed].terminal) {
    const double wanted =
        network.segments[fed].load.proximal_resistance + network.segments[fed].load.distal_resistance;
    const double least = resistanceBehind(network, tree, leaving, root, 0);
    if (!(least < wanted))
      throw NetworkError(tree.network_file, 0, "r_prox_m", formatNumber(tree.segments[0].radius_proximal),
                         "vessels wide enough for the flow of " + supply);
    double low = 0, high = 1;
    while (resistanceBehind(network, tree, leaving, root, high) < wanted && high < 1e12) high *= 2;
    for (int i = 0; i < 100; ++i) {
      scale = 0.5 * (low + high);
      (resistanceBehind(network, tree, leaving, root, scale) < wanted ? low : high) = scale;
    }
    network.segments[fed].terminal = false;
    network.segments[fed].load = {};
  }

  long label = 0;
  for (const SegmentSpec& s : network.segments) label = std::max({label, s.node_in, s.node_out});
  std::map<long, long> node_of{{root, network.segments[fed].node_out}};
  std::vector<int> ends;
  for (SegmentSpec s : tree.segments) {
    for (long* node : {&s.node_in, &s.node_out}) {
      const auto [known, fresh] = node_of.emplace(*node, label + 1);
      if (fresh) ++label;
      *node = known->second;
    }
    s.id = s.name;
    s.line = 0;
    s.load.distal_resistance *= scale;
    s.load.proximal_resistance *= scale;
    s.load.compliance /= scale;
    if (s.terminal) ends.push_back(static_cast<int>(network.segments.size()));
    network.segments.push_back(std::move(s));
  }
  for (Territory& territory : patient.territories) {
    const auto place = std::find(territory.segments.begin(), territory.segments.end(), static_cast<int>(fed));
    if (place == territory.segments.end()) continue;
    territory.segments.erase(place);
    territory.segments.insert(territory.segments.end(), ends.begin(), ends.end());
  }
}

}  // namespace vest::haemodynamics

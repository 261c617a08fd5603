#include "vest_effects/haemodynamics/model.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

namespace vest::haemodynamics {

namespace {

constexpr double kPi = 3.14159265358979323846;

[[noreturn]] void refuse(const Network& network, const SegmentSpec& segment, const char* field,
                         const std::string& value, const std::string& allowed) {
  throw NetworkError(network.network_file, segment.line, field, value, allowed);
}

void need(bool good, const Network& network, const SegmentSpec& segment, const char* field, double value,
          const std::string& allowed) {
  // `good` is a comparison that NaN fails.
  if (!good || !std::isfinite(value)) refuse(network, segment, field, formatNumber(value), allowed);
}

void checkCase(const Network& network) {
  const auto check = [&](const char* key, double value, bool good, const char* allowed) {
    if (good && std::isfinite(value)) return;
    const auto found = network.case_lines.find(key);
    throw NetworkError(network.case_file, found == network.case_lines.end() ? 0 : found->second, key,
                       formatNumber(value), allowed);
  };
  check("rho", network.density, network.density >= 1 && network.density <= 1e5, "1 ... 100000 kg/m3");
  check("mu", network.viscosity, network.viscosity >= 0 && network.viscosity <= 1e3, "0 ... 1000 Pa s");
  check("zeta", network.profile, network.profile > 0 && network.profile <= 1e3, "> 0, at most 1000");
  check("period_s", network.period, network.period >= 1e-3 && network.period <= 1e4, "0.001 ... 10000 s");
}

void checkInflow(const Network& network) {
  const std::string& file = network.inflow_file;
  if (network.inflow.empty()) throw NetworkError(file, 0, "rows", "0", "at least one row");
  double before = -1;
  for (const auto& point : network.inflow) {
    if (!std::isfinite(point.flow))
      throw NetworkError(file, point.line, "Q_m3_s", formatNumber(point.flow), "a finite number");
    if (!(point.time >= 0 && point.time <= network.period * (1 + 1e-9)))
      throw NetworkError(file, point.line, "t_s", formatNumber(point.time),
                         "0 ... period_s = " + formatNumber(network.period));
    if (!(point.time > before))
      throw NetworkError(file, point.line, "t_s", formatNumber(point.time), "strictly rising times");
    before = point.time;
  }
}

void checkName(const Network& network, const SegmentSpec& segment) {
  const std::string& name = segment.name;
  const bool good = !name.empty() && name.size() <= 200 && name[0] != '.' &&
                    std::all_of(name.begin(), name.end(), [](char c) {
                      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                             c == '_' || c == '-' || c == '.';
                    });
  if (!good) refuse(network, segment, "name", name, "1 to 200 of A-Z a-z 0-9 _ - . (not first)");
}

void checkSegments(const Network& network) {
  if (network.segments.empty()) throw NetworkError(network.network_file, 0, "rows", "0", "at least one row");
  std::set<std::string> ids, names;
  for (const auto& s : network.segments) {
    if (s.id.empty() || !ids.insert(s.id).second) refuse(network, s, "id", s.id, "an id of its own");
    checkName(network, s);
    if (!names.insert(s.name).second) refuse(network, s, "name", s.name, "a name of its own");
    if (s.node_in == s.node_out)
      refuse(network, s, "node_out", std::to_string(s.node_out), "another node than node_in");
    // Ends (assumed) that no vessel or model of one comes near: beyond them results are finite and mean
    // nothing.
    const auto within = [&](const char* field, double value, double least, double most) {
      need(value >= least && value <= most, network, s, field, value,
           formatNumber(least) + " ... " + formatNumber(most));
    };
    within("length_m", s.length, 1e-6, 1e3);
    within("r_prox_m", s.radius_proximal, 1e-7, 1);
    within("r_dist_m", s.radius_distal, 1e-7, 1);
    if (network.wall_thickness_law) {
      need(network.wall_thickness_law->thickness(s.radius_proximal) > 0, network, s, "r_prox_m",
           s.radius_proximal, "a radius at which wall_thickness_law gives a thickness > 0");
      need(network.wall_thickness_law->thickness(s.radius_distal) > 0, network, s, "r_dist_m",
           s.radius_distal, "a radius at which wall_thickness_law gives a thickness > 0");
    } else {
      within("h_prox_m", s.wall_proximal, 1e-9, 1);
      within("h_dist_m", s.wall_distal, 1e-9, 1);
    }
    within("E_Pa", s.youngs_modulus, 1, 1e18);
    within("P_ref_Pa", s.reference_pressure, -1e7, 1e7);
    within("R1_Pa_s_m3", s.load.proximal_resistance, 0, 1e15);
    within("R2_Pa_s_m3", s.load.distal_resistance, 0, 1e15);
    within("C_m3_Pa", s.load.compliance, 0, 1);
    within("P_out_Pa", s.load.outflow_pressure, -1e7, 1e7);
    if (s.terminal && !(s.load.proximal_resistance + s.load.distal_resistance > 0))
      refuse(network, s, "R1_Pa_s_m3", formatNumber(s.load.proximal_resistance),
             "R1_Pa_s_m3 + R2_Pa_s_m3 > 0 at a terminal");
  }
}

struct Graph {
  std::vector<long> label;                     ///< in order of appearance
  std::vector<std::vector<int>> starts, ends;  ///< segments
  int inflow = -1;
};

Graph buildGraph(const Network& network) {
  Graph graph;
  std::unordered_map<long, int> index;
  const auto node = [&](long label) {
    const auto [found, is_new] = index.emplace(label, static_cast<int>(graph.label.size()));
    if (is_new) {
      graph.label.push_back(label);
      graph.starts.emplace_back();
      graph.ends.emplace_back();
    }
    return found->second;
  };
  for (std::size_t i = 0; i < network.segments.size(); ++i) {
    const int in = node(network.segments[i].node_in);
    const int out = node(network.segments[i].node_out);
    graph.starts[in].push_back(static_cast<int>(i));
    graph.ends[out].push_back(static_cast<int>(i));
  }
  std::vector<int> sources;
  for (std::size_t n = 0; n < graph.label.size(); ++n) {
    if (graph.ends[n].empty()) sources.push_back(static_cast<int>(n));
  }
  if (sources.empty())
    throw NetworkError(
        network.network_file, network.segments[0].line, "node_in",
        std::to_string(network.segments[0].node_in),
        "one node that no segment ends in (the inflow); this network is a loop without inflow");
  graph.inflow = sources[0];

  // Connected, directions aside: flow may run either way.
  std::vector<char> reached(graph.label.size(), 0);
  std::vector<int> open{graph.inflow};
  reached[graph.inflow] = 1;
  while (!open.empty()) {
    const int n = open.back();
    open.pop_back();
    const auto visit = [&](int other) {
      if (!reached[other]) {
        reached[other] = 1;
        open.push_back(other);
      }
    };
    for (int s : graph.starts[n]) visit(index.at(network.segments[s].node_out));
    for (int s : graph.ends[n]) visit(index.at(network.segments[s].node_in));
  }
  for (const auto& s : network.segments) {
    if (!reached[index.at(s.node_in)])
      refuse(network, s, "node_in", std::to_string(s.node_in),
             "a node that is connected with the inflow node " + std::to_string(graph.label[graph.inflow]));
  }
  if (sources.size() > 1) {
    const auto& s = network.segments[graph.starts[sources[1]][0]];
    refuse(network, s, "node_in", std::to_string(s.node_in),
           "one inflow node only (a node that no segment ends in); node " +
               std::to_string(graph.label[sources[0]]) + " is one already");
  }
  for (std::size_t n = 0; n < graph.label.size(); ++n) {
    for (int i : graph.ends[n]) {
      const auto& s = network.segments[i];
      if (s.terminal && (!graph.starts[n].empty() || graph.ends[n].size() > 1))
        refuse(network, s, "terminal", "1",
               "a terminal only where no other segment meets (node " + std::to_string(graph.label[n]) +
                   " has others)");
      if (!s.terminal && graph.starts[n].empty())
        refuse(network, s, "terminal", "0",
               "1, with R1_Pa_s_m3 and R2_Pa_s_m3: no segment leads on from node " +
                   std::to_string(graph.label[n]));
    }
  }
  return graph;
}

struct Geometry {
  double sqrt_area_ref, beta;
};

Geometry geometryAt(const Network& network, const SegmentSpec& s, double fraction) {
  const double r = s.radius_proximal + fraction * (s.radius_distal - s.radius_proximal);
  const double h = network.wall_thickness_law
                       ? network.wall_thickness_law->thickness(r)
                       : s.wall_proximal + fraction * (s.wall_distal - s.wall_proximal);
  const double area = kPi * r * r;
  return {std::sqrt(kPi) * r, 4.0 / 3.0 * std::sqrt(kPi) * s.youngs_modulus * h / area};
}

void discretise(const Network& network, double dx, Model& model) {
  double total = 0;
  for (const auto& s : network.segments) total += std::max<double>(kLeastCells, std::ceil(s.length / dx));
  if (!(total <= static_cast<double>(kMostCells)))
    throw NetworkError(network.network_file, 0, "dx", formatNumber(dx),
                       "a cell size that gives at most " + std::to_string(kMostCells) + " cells");
  for (const auto& s : network.segments) {
    SegmentModel m;
    m.id = s.id;
    m.name = s.name;
    // The tolerance keeps 0.1/0.02 at 5 cells.
    m.cells = std::max(kLeastCells, static_cast<int>(std::ceil(s.length / dx * (1 - 1e-12))));
    m.first_cell = model.cells;
    m.first_face = static_cast<int>(model.face_inv_beta.size());
    m.length = s.length;
    m.dx = s.length / m.cells;
    m.reference_pressure = s.reference_pressure;
    const Geometry mid = geometryAt(network, s, 0.5);
    m.sqrt_area_ref_mid = mid.sqrt_area_ref;
    m.beta_mid = mid.beta;
    for (int i = 0; i < m.cells; ++i) {
      const Geometry g = geometryAt(network, s, (i + 0.5) / m.cells);
      model.sqrt_area_ref.push_back(g.sqrt_area_ref);
      model.beta.push_back(g.beta);
    }
    for (int i = 0; i <= m.cells; ++i) {
      const Geometry g = geometryAt(network, s, static_cast<double>(i) / m.cells);
      if (!(g.beta > 0) || !std::isfinite(g.beta) || !std::isfinite(1 / g.beta))
        refuse(network, s, "E_Pa", formatNumber(s.youngs_modulus),
               "values that give a finite wall stiffness > 0");
      model.face_sqrt_area_ref.push_back(g.sqrt_area_ref);
      model.face_inv_beta.push_back(1 / g.beta);
      model.face_half_rho_beta.push_back(0.5 * network.density * g.beta);
    }
    model.cells += m.cells;
    model.segments.push_back(std::move(m));
  }
}

Branch branchOf(const Model& model, int segment, bool distal) {
  const SegmentModel& s = model.segments[segment];
  Branch b;
  b.segment = segment;
  b.distal = distal;
  b.cell = distal ? s.first_cell + s.cells - 1 : s.first_cell;
  b.face = distal ? s.first_face + s.cells : s.first_face;
  b.sign = distal ? 1 : -1;
  b.reference_pressure = s.reference_pressure;
  const double root = 2 * model.density * model.face_inv_beta[b.face];
  b.speed_ref_squared = model.face_sqrt_area_ref[b.face] / root;
  b.area_factor = root * root;
  b.inv_dx = 1 / s.dx;
  return b;
}

void connect(const Network& network, const Graph& graph, Model& model) {
  for (std::size_t n = 0; n < graph.label.size(); ++n) {
    NodeModel node;
    node.label = graph.label[n];
    node.first_branch = static_cast<int>(model.branches.size());
    for (int s : graph.ends[n]) {
      model.branches.push_back(branchOf(model, s, true));
      model.segments[s].node_out = static_cast<int>(n);
      if (network.segments[s].terminal) {
        node.kind = NodeKind::kTerminal;
        node.load = network.segments[s].load;
      }
    }
    for (int s : graph.starts[n]) {
      model.branches.push_back(branchOf(model, s, false));
      model.segments[s].node_in = static_cast<int>(n);
    }
    node.branches = static_cast<int>(model.branches.size()) - node.first_branch;
    if (static_cast<int>(n) == graph.inflow) node.kind = NodeKind::kInflow;
    model.nodes.push_back(node);
  }
}

void buildInflow(const Network& network, Model& model) {
  // Close the curve over the period: linear from the last point to the first of the next period.
  const auto& in = network.inflow;
  const double period = network.period;
  const double first = in.front().time, last = std::min(in.back().time, period);
  const double gap = first + (period - last);
  const double at_zero = gap > 0
                             ? in.back().flow + (in.front().flow - in.back().flow) * ((period - last) / gap)
                             : in.front().flow;
  if (first > 0) {
    model.inflow_time.push_back(0);
    model.inflow_flow.push_back(at_zero);
  }
  for (const auto& point : in) {
    model.inflow_time.push_back(std::min(point.time, period));
    model.inflow_flow.push_back(point.flow);
  }
  if (last < period) {
    model.inflow_time.push_back(period);
    model.inflow_flow.push_back(at_zero);
  }
  model.inflow_volume.assign(model.inflow_time.size(), 0);
  for (std::size_t i = 1; i < model.inflow_time.size(); ++i) {
    model.inflow_volume[i] =
        model.inflow_volume[i - 1] + 0.5 * (model.inflow_flow[i] + model.inflow_flow[i - 1]) *
                                         (model.inflow_time[i] - model.inflow_time[i - 1]);
  }
}

}  // namespace

double Model::inflowAt(double phase) const {
  const auto upper = std::upper_bound(inflow_time.begin(), inflow_time.end(), phase);
  if (upper == inflow_time.begin()) return inflow_flow.front();
  if (upper == inflow_time.end()) return inflow_flow.back();
  const auto i = upper - inflow_time.begin();
  const double share = (phase - inflow_time[i - 1]) / (inflow_time[i] - inflow_time[i - 1]);
  return inflow_flow[i - 1] + share * (inflow_flow[i] - inflow_flow[i - 1]);
}

double Model::inflowVolume(double phase) const {
  double whole = 0;
  while (phase >= period) {
    phase -= period;
    whole += inflow_volume.back();
  }
  const auto upper = std::upper_bound(inflow_time.begin(), inflow_time.end(), phase);
  if (upper == inflow_time.end()) return whole + inflow_volume.back();
  const auto i = upper - inflow_time.begin();
  return whole + inflow_volume[i - 1] +
         0.5 * (inflow_flow[i - 1] + inflowAt(phase)) * (phase - inflow_time[i - 1]);
}

Model buildModel(const Network& network, double dx) {
  if (!(dx > 0) || !std::isfinite(dx))
    throw NetworkError(network.network_file, 0, "dx", formatNumber(dx), "> 0 m");
  checkCase(network);
  checkSegments(network);
  checkInflow(network);
  const Graph graph = buildGraph(network);
  Model model;
  model.density = network.density;
  model.viscosity = network.viscosity;
  model.profile = network.profile;
  model.period = network.period;
  model.friction = 2 * (network.profile + 2) * network.viscosity * kPi / network.density;
  discretise(network, dx, model);
  connect(network, graph, model);
  buildInflow(network, model);
  return model;
}

}  // namespace vest::haemodynamics

#include "vest_tissue/modelling/tree.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "text.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/solver/random.h"

namespace vest::modelling {
namespace {

constexpr std::size_t kMostSigns = 20000, kMostBranches = 400;
// Of blood and of the heart's beat, as in the network of the shipped patient.
constexpr double kViscosity = 0.004;       // Pa·s
constexpr double kDensity = 1040.0;        // kg/m³
constexpr double kPeriod = 0.857;          // s: 70 a minute (assumed)
constexpr double kMeanPressure = 13300.0;  // Pa: 100 mmHg (assumed)
constexpr double kReference = 10000.0;     // Pa, at which walls have their radius
constexpr double kTerminalTime = 0.2266;   // s: R2·C of the shipped patient's ends

std::string rewritten(const TreeSpec& spec) {
  std::string word = spec.axiom;
  for (std::uint32_t step = 0; step < spec.steps; ++step) {
    std::string next;
    for (const char sign : word) {
      const auto rule = spec.productions.find(sign);
      next += rule == spec.productions.end() ? std::string(1, sign) : rule->second;
      if (next.size() > kMostSigns)
        throw std::invalid_argument("steps: " + std::to_string(spec.steps) + " give more than " +
                                    std::to_string(kMostSigns) + " signs; allowed: fewer");
    }
    word = next;
  }
  return word;
}

struct Shoot {
  int parent = -1;
  std::uint32_t units = 1, turns = 0;
  std::vector<int> next;
  std::uint32_t ends = 0;
};

/// The word as branches. A bracket returns to the branch before it.
std::vector<Shoot> shootsOf(const std::string& word) {
  std::vector<Shoot> shoots;
  struct Level {
    int at;
    bool longer;  // the next F makes the branch longer
    std::uint32_t turns;
  };
  std::vector<Level> levels{{-1, false, 0}};
  for (const char sign : word) {
    Level& level = levels.back();
    if (sign == 'F') {
      if (level.longer) {
        ++shoots[static_cast<std::size_t>(level.at)].units;
        continue;
      }
      if (level.at < 0 && !shoots.empty())
        throw std::invalid_argument("more than one branch begins at the root; allowed: one");
      Shoot shoot;
      shoot.parent = level.at;
      shoot.turns = level.turns;
      const int index = static_cast<int>(shoots.size());
      if (level.at >= 0) shoots[static_cast<std::size_t>(level.at)].next.push_back(index);
      shoots.push_back(shoot);
      if (shoots.size() > kMostBranches)
        throw std::invalid_argument("more than " + std::to_string(kMostBranches) +
                                    " branches; allowed: at most as many");
      level = {index, true, 0};
    } else if (sign == '/') {
      ++level.turns;
    } else if (sign == '[') {
      level.longer = false;
      levels.push_back({level.at, false, level.turns});
      if (levels.size() > 64) throw std::invalid_argument("brackets deeper than 64");
    } else if (sign == ']') {
      if (levels.size() == 1) throw std::invalid_argument("a ] without its [");
      levels.pop_back();
    }
  }
  if (levels.size() != 1) throw std::invalid_argument("a [ without its ]");
  if (shoots.empty()) throw std::invalid_argument("no F: no branch; allowed: at least one");
  for (std::size_t i = shoots.size(); i-- > 0;) {
    Shoot& shoot = shoots[i];
    if (shoot.next.size() > 2)
      throw std::invalid_argument("three branches leave at one place; allowed: one or two");
    if (shoot.next.empty()) shoot.ends = 1;
    if (shoot.parent >= 0) shoots[static_cast<std::size_t>(shoot.parent)].ends += shoot.ends;
  }
  return shoots;
}

std::vector<TreeBranch> byRules(const TreeSpec& spec) {
  for (const char sign : spec.axiom) {
    if ((sign < 'A' || sign > 'Z') && sign != '[' && sign != ']' && sign != '/')
      throw std::invalid_argument("axiom: " + files::shown(spec.axiom) +
                                  "; allowed: A to Z, [ and ] and /, F is a branch");
  }
  const std::vector<Shoot> shoots = shootsOf(rewritten(spec));
  if (!(spec.direction.norm() > 1e-9) ||
      !(spec.direction.cross(spec.plane).norm() > 1e-9 * spec.plane.norm()))
    throw std::invalid_argument("direction and plane must be two directions");

  std::vector<Vector3> directions(shoots.size());
  std::vector<TreeBranch> branches(shoots.size());
  const auto scattered = [&](std::size_t i, std::uint64_t which) {
    return 1.0 + spec.scatter * (2.0 * solver::randomUniform(spec.seed, i, which) - 1.0);
  };
  for (std::size_t i = 0; i < shoots.size(); ++i) {
    const Shoot& shoot = shoots[i];
    TreeBranch& branch = branches[i];
    branch.parent = shoot.parent;
    branch.ends = shoot.ends;
    if (shoot.parent < 0) {
      directions[i] = spec.direction.normalized();
      branch.axis = spec.direction.cross(spec.plane).normalized();
      branch.radius = spec.radius;
      branch.from = spec.root;
    } else {
      const std::size_t p = static_cast<std::size_t>(shoot.parent);
      const TreeBranch& before = branches[p];
      directions[i] = directions[p];
      branch.axis = before.axis;
      branch.radius = before.radius;
      branch.from = before.to;
      const auto& siblings = shoots[p].next;
      if (siblings.size() == 2) {
        const bool first = siblings[0] == static_cast<int>(i);
        branch.radius = radiusBehind(before, shoot.ends);
        const double beside = radiusBehind(before, before.ends - shoot.ends);
        const double angle = branchAngle(before.radius, branch.radius, beside) * scattered(i, 1);
        // Both turn about the axis that the first of them has.
        const std::uint32_t turns = shoots[static_cast<std::size_t>(siblings[0])].turns;
        branch.axis = Eigen::AngleAxisd(turns * spec.turn, directions[p]) * before.axis;
        directions[i] = Eigen::AngleAxisd(first ? angle : -angle, branch.axis) * directions[p];
      }
    }
    branch.to = branch.from + spec.length * branch.radius * shoot.units * scattered(i, 0) * directions[i];
  }
  return branches;
}

/// Without what is thinner than `least`: a branch whose followers are all thin ends the tree, a thin one
/// beside another is kept undrawn.
std::vector<TreeBranch> withoutThin(const std::vector<TreeBranch>& all, double least) {
  std::vector<int> kept(all.size(), -1);
  std::vector<char> leads_on(all.size(), 0);
  for (const TreeBranch& branch : all)
    if (branch.parent >= 0 && branch.radius >= least) leads_on[static_cast<std::size_t>(branch.parent)] = 1;
  std::vector<TreeBranch> branches;
  for (std::size_t i = 0; i < all.size(); ++i) {
    TreeBranch branch = all[i];
    if (branch.parent >= 0) {
      const std::size_t p = static_cast<std::size_t>(branch.parent);
      if (kept[p] < 0 || leads_on[p] == 0) continue;
      branch.parent = kept[p];
      branch.drawn = branch.radius >= least;
    }
    branches.push_back(branch);
    if (branch.drawn) kept[i] = static_cast<int>(branches.size()) - 1;
  }
  return branches;
}

}  // namespace

double radiusExponent(double radius) {
  return radius > 1e-3 ? 2.33 : radius > 1e-4 ? 2.7 : 3.0;
}

double radiusBehind(const TreeBranch& before, std::uint32_t ends) {
  return before.radius *
         std::pow(static_cast<double>(ends) / before.ends, 1.0 / radiusExponent(before.radius));
}

double branchAngle(double before, double this_one, double other) {
  const double a = before * before, b = this_one * this_one, c = other * other;
  return std::acos(std::clamp((a * a + b * b - c * c) / (2 * a * b), -1.0, 1.0));
}

double wallOf(double radius) {
  return radius * (0.2802 * std::exp(-505.3 * radius) + 0.1324 * std::exp(-11.14 * radius));
}

double flowOf(double radius) {
  return M_PI * radius * radius * radius * kShear / (4 * kViscosity);
}

std::string branchName(const std::string& tree, std::size_t branch) {
  return tree + "_" + std::to_string(branch + 1);
}

std::vector<TreeBranch> growTree(const TreeSpec& spec) {
  if (spec.radius < spec.least)
    throw std::invalid_argument("radius: must be at least `least`, " + std::to_string(spec.least) + " m");
  return withoutThin(spec.region ? fillRegion(spec) : byRules(spec), spec.least);
}

scene::VesselTree vesselTree(const std::string& name, const TreeSpec& spec,
                             const std::vector<TreeBranch>& branches, double youngs_modulus) {
  scene::VesselTree tree;
  tree.folder = name;
  tree.supply = spec.supply;
  tree.case_json = text(
      "{\n  \"title\": \"%s: a tree that vest_model grew\",\n  \"rho\": %.10g,\n  \"mu\": %.10g,\n  "
      "\"zeta\": 2,\n"
      "  \"period_s\": %.10g,\n  \"taper\": \"linear\"\n}\n",
      name.c_str(), kDensity, kViscosity, kPeriod);
  const double flow = spec.flow > 0 ? spec.flow : flowOf(spec.radius);
  // A half sine of a third of the beat above a steady half: a shape for trials alone (assumed). In a session
  // the patient's heart drives it.
  tree.inflow_csv = "t_s,Q_m3_s\n";
  constexpr int kPoints = 40;
  double mean = 0;
  std::vector<double> curve;
  for (int i = 0; i < kPoints; ++i) {
    const double phase = static_cast<double>(i) / kPoints;
    curve.push_back(0.5 + (phase < 1.0 / 3 ? std::sin(3 * M_PI * phase) : 0.0));
    mean += curve.back() / kPoints;
  }
  for (int i = 0; i < kPoints; ++i)
    tree.inflow_csv +=
        text("%.10g,%.10g\n", kPeriod * i / kPoints, flow * curve[static_cast<std::size_t>(i)] / mean);
  tree.network_csv =
      "id,name,node_in,node_out,length_m,r_prox_m,r_dist_m,h_prox_m,h_dist_m,E_Pa,P_ref_Pa,terminal,R1_Pa_s_"
      "m3,"
      "R2_Pa_s_m3,C_m3_Pa,P_out_Pa\n";
  for (std::size_t i = 0; i < branches.size(); ++i) {
    const TreeBranch& b = branches[i];
    const bool leads_on = std::any_of(branches.begin(), branches.end(), [&](const TreeBranch& other) {
      return other.parent == static_cast<int>(i);
    });
    double r1 = 0, r2 = 0, c = 0;
    if (!leads_on) {
      const double area = M_PI * b.radius * b.radius, wall = wallOf(b.radius);
      const double speed = std::sqrt(2.0 / 3.0 * youngs_modulus * wall / (kDensity * b.radius));
      const double whole = kMeanPressure / flow * branches[0].ends / b.ends;
      r1 = std::min(kDensity * speed / area, 0.5 * whole);  // its own impedance: no echo
      r2 = whole - r1;
      c = kTerminalTime / r2;
    }
    // Node 1 is the root, node i + 2 the end of branch i.
    tree.network_csv +=
        text("%zu,%s,%d,%zu,%.10g,%.10g,%.10g,%.10g,%.10g,%.10g,%.10g,%d,%.10g,%.10g,%.10g,0\n", i + 1,
             branchName(name, i).c_str(), b.parent + 2, i + 2, (b.to - b.from).norm(), b.radius, b.radius,
             wallOf(b.radius), wallOf(b.radius), youngs_modulus, kReference, leads_on ? 0 : 1, r1, r2, c);
  }
  return tree;
}

}  // namespace vest::modelling

#include <algorithm>
#include <array>
#include <cmath>

#include "sections.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/calibration.h"
#include "vest_tissue/scene/world.h"

namespace vest::validate {
namespace {

using modelling::Lattice;
using validation::digits;

constexpr double kHeight = 0.02;  // m
constexpr double kModulus = 8e3;  // Pa

Lattice bar(int across, double nu) {
  Lattice l;
  l.cells = {across, across, 4 * across};
  l.cell = kHeight / across;
  l.law.youngs_modulus = kModulus;
  l.poisson_ratio = nu;
  return l;
}

/// Own weight of a bar that hangs from one end, in the World: elongation of its end, m.
double hang(int across, double dt) {
  Lattice l = bar(across, 0.25);
  l.damping_time = 2e-3;
  auto net = modelling::makeLattice(l);
  for (std::size_t i = 0; i < net.mass.size(); ++i) net.damping[i] = 30.0 * net.mass[i];
  for (int i = 0; i <= across; ++i)
    for (int j = 0; j <= across; ++j) net.fixed[l.knot(i, j, 0)] = 1;
  scene::Description d;
  d.name = "bar";
  d.gravity = {0, 0, 2.0};
  d.dt = dt;
  d.objects.push_back(net);
  scene::World w(d);
  scene::StepInput in;
  in.dt = dt;
  scene::StepReport report;
  for (int i = 0; i < std::lround(1.5 / dt); ++i) w.step(in, report);
  std::vector<float> p(3 * w.knotCount(0));
  w.positions(0, p.data());
  const auto end = l.knot(0, 0, 4 * across);
  return p[3 * end + 2] - net.rest_position[end].z();
}

void followsTheLaw(validation::Section& s) {
  const material::Law tissue{kModulus, 1.0, 4.0, 0.0, 0.4};
  const auto fit = modelling::fitLinkLaw(tissue, 0.25);
  Lattice l = bar(2, 0.25);
  l.law = fit.law;
  const auto net = modelling::makeLattice(l);
  validation::Plot p{"Bar of a lattice and the law", "strain, no unit", "stress, kPa", {}, false, false};
  validation::Curve law{"σ(ε) of the tissue", {}, {}, validation::Mark::Line},
      own{"lattice with the tissue's own a2 … a4", {}, {}, validation::Mark::Dashed},
      net_points{"lattice, calibrated, measured", {}, {}, validation::Mark::Points};
  double worst = 0.0;
  for (int i = -6; i <= 16; ++i) {
    const double e = 0.025 * i;
    law.x.push_back(e), law.y.push_back(1e-3 * material::stress(tissue, e));
    own.x.push_back(e), own.y.push_back(1e-3 * kModulus * modelling::barResponse(tissue, 0.25, e).stress);
    if (i < 2 || i % 2 != 0) continue;
    Eigen::Matrix3d pull = Eigen::Matrix3d::Zero();
    pull(2, 2) = material::stress(tissue, e);
    const auto x = modelling::equilibrium(net, modelling::uniformTraction(l, pull));
    const double strain = modelling::displacementGradient(net, x)(2, 2);
    net_points.x.push_back(strain), net_points.y.push_back(1e-3 * pull(2, 2));
    worst = std::max(worst, std::fabs(strain - e) / e);
  }
  p.curves = {law, own, net_points};
  s.text(
      "**Large strain.** The links of a lattice turn and its diagonals stretch less than the bar: with the "
      "tissue's own coefficients the bar is softer than the law.\nfitLinkLaw() finds the coefficients of the "
      "links for which the bar follows it.");
  s.plot("law", p);
  s.atMost("strain of the calibrated bar at the law's stress, 5 to 40 %", 100 * worst, 1.0, "%");
  double slope = 0.0;
  for (const double e : {-0.15, -0.1, -0.05})
    slope = std::max(slope, std::fabs(modelling::barResponse(fit.law, 0.25, e).stress / e - 1.0));
  s.atMost("compression to 15 %: stress against E·ε", 100 * slope, 15.0, "%");
}

/// Straight organs of shipped scenes, baked; bars of all their rings but for some at the ends.
void cutFromOrgans(validation::Section& s) {
  const std::string data = material::databasePath();
  const std::string scenes = data.substr(0, data.rfind("/data/")) + "/scenes/";
  const auto materials = modelling::readMaterials(data);
  s.text(
      "**Bars cut from organs.** Rings of an organ as it was baked, without what else holds it; pulled at "
      "its "
      "ends by the solver of a session. Asked is the modulus of its\ntissue times the scene's "
      "stiffness_factor. Bent organs are left out: their bars bend.");
  std::vector<std::vector<std::string>> rows;
  double worst = 0.0;
  const std::vector<std::array<const char*, 2>> organs{
      {"tube", "tube"},        {"clip_tube", "vessel"},        {"cut_strip", "strip"},
      {"hook_strip", "strip"}, {"gallbladder", "common_duct"}, {"gallbladder", "cystic_artery_1"}};
  for (const auto& [scene, name] : organs) {
    const auto source = modelling::readSource(scenes + scene + "/source.yaml");
    const auto from = std::find_if(source.objects.begin(), source.objects.end(),
                                   [&n = name](const auto& o) { return o.name == n; });
    const modelling::RingNet net =
        from->tube ? modelling::makeTube(*from->tube) : modelling::makeSheet(*from->sheet);
    const auto baked = modelling::bake(source, materials);
    const auto& organ = baked.objects[static_cast<std::size_t>(from - source.objects.begin())];
    const std::uint32_t first = 4, last = net.rings - 5;
    std::vector<double> section;
    for (std::uint32_t r = first; r < last; ++r) section.push_back(0.5 * (net.wall[r] + net.wall[r + 1]));
    const double asked = materials.at(from->material).law().youngs_modulus * from->stiffness_factor,
                 found = modelling::barModulus(modelling::cutBar(organ, first, last), section);
    rows.push_back({scene, name, from->material, digits(1e-3 * asked), digits(1e-3 * found)});
    worst = std::max(worst, std::fabs(found / asked - 1.0));
  }
  s.table({"scene", "organ", "tissue", "E asked, kPa", "E found, kPa"}, rows);
  s.atMost("bars cut from organs: E", 100 * worst, 5.0, "%");
}

}  // namespace

validation::Section barsSection(const Options& o, const std::string& command) {
  validation::Section s("11_bars", "Nets: bars in tension, compression, shear and bending", command);
  s.text(
      "A lattice of springs along edges and face diagonals with a volume element a cell, made from E = 8 kPa "
      "and ν (modelling/lattice.h). Central springs alone have\nν = 1/4; what comes out is reported. Uniform "
      "traction for E, ν and G; pure bending for the last column, whose error is that of few knots over the "
      "height, 0.9/n².");
  std::vector<std::vector<std::string>> rows;
  double tension = 0.0, poisson = 0.0, shear = 0.0;
  validation::Curve error{"bending, ν = 1/4", {}, {}, validation::Mark::Points},
      theory{"0.9/n²", {}, {}, validation::Mark::Line};
  for (const double nu : {0.25, 0.35, 0.45}) {
    for (const int n : o.full ? std::vector<int>{2, 3, 4, 6, 8} : std::vector<int>{2, 3, 4}) {
      const auto m = modelling::moduliOf(bar(n, nu));
      const double g = kModulus / (2 * (1 + nu)), bending = modelling::bendingModulus(bar(n, nu));
      rows.push_back({digits(nu), std::to_string(n), digits(m.youngs), digits(m.poisson), digits(m.shear),
                      digits(bending)});
      tension = std::max(tension, std::fabs(m.youngs / kModulus - 1.0));
      poisson = std::max(poisson, std::fabs(m.poisson - nu));
      shear = std::max(shear, std::fabs(m.shear / g - 1.0));
      if (nu == 0.25) {
        error.x.push_back(n), error.y.push_back(100 * std::fabs(bending / kModulus - 1.0));
        theory.x.push_back(n), theory.y.push_back(90.0 / (n * n));
        s.atMost("bending, n = " + std::to_string(n) + ": E", error.y.back(), 100.0 / (n * n), "%");
      }
    }
  }
  s.table({"ν asked", "cells across", "E, Pa", "ν", "G, Pa", "E by bending, Pa"}, rows);
  s.plot("bending", {"Bending against mesh density",
                     "cells over the height, no unit",
                     "error of E, %",
                     {error, theory},
                     true,
                     true});
  s.atMost("tension and compression at small strain: E, all meshes", 100 * tension, 0.3, "%");
  s.atMost("ν, all meshes", poisson, 0.006, "no unit");
  s.atMost("shear: G, all meshes", 100 * shear, 0.3, "%");
  followsTheLaw(s);
  cutFromOrgans(s);

  s.text("**In the World.** A bar hangs by its own weight from a clamped end; elongation ρ·g·L²/(2·E).");
  const double length = 4 * kHeight, expected = 1000.0 * 2.0 * length * length / (2 * kModulus);
  rows.clear();
  double least = 1e9, most = 0.0, clamped = 0.0;
  for (const int n : {1, 2}) {
    for (const double dt : {1e-3, 5e-4, 2.5e-4}) {
      const double longer = hang(n, dt);
      rows.push_back({std::to_string(n), digits(1e3 * dt), digits(1e3 * longer), digits(1e3 * expected)});
      clamped = std::max(clamped, std::fabs(longer / expected - 1.0));
      if (n == 2) least = std::min(least, longer), most = std::max(most, longer);
    }
  }
  s.table({"cells across", "dt, ms", "elongation, mm", "theory, mm"}, rows);
  s.atMost("elongation at dt of 1, 0.5 and 0.25 ms, spread", 100 * (most / least - 1.0), 0.1, "%");
  s.atMost("elongation against theory (the clamped end may not narrow)", 100 * clamped, 8.0, "%");
  return s;
}

}  // namespace vest::validate

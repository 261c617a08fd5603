#include <algorithm>
#include <cmath>
#include <string>

#include "boxes.h"
#include "sections.h"

namespace vest::validate {
namespace {

using namespace fluid;
using validation::Curve;
using validation::digits;
using validation::Mark;
using validation::Plot;
using validation::Section;

double percent(double value, double theory) {
  return 100 * (value / theory - 1);
}

Source irrigator() {
  Source s;
  s.area = 3.14159265358979 * 0.0025 * 0.0025;
  s.flow = 5e-5;
  s.blood = 0;
  return s;
}

void dry(specimen::Fluid& f) {
  std::fill(f.state.pools.bed.begin(), f.state.pools.bed.end(), kNoBed);
}

void jetRange(Section& section) {
  section.text("### Range against ballistics");
  section.text("3 l/min through 5 mm (2.546 m/s), 0.15 m above the level where it is caught.");
  std::vector<std::vector<std::string>> rows;
  Plot plot{"Jets of 3 l/min", "y, m", "z, m", {}};
  for (const double degrees : {0.0, 30.0, 60.0}) {
    Parameters p;
    p.low = {-0.1, -0.2, -0.2}, p.high = {0.1, 1.2, 0.6}, p.capacity = 6000;
    specimen::Fluid f(p, {});
    f.inputs.source_count = 1;
    f.inputs.sources[0] = irrigator();
    const double a = degrees * 3.14159265358979 / 180, v = 5e-5 / f.inputs.sources[0].area,
                 vy = v * std::cos(a), vz = v * std::sin(a), h = 0.15;
    f.inputs.sources[0].direction = {0, std::cos(a), std::sin(a)};
    f.inputs.sources[0].position = {0, 0, h};
    const double t = (vz + std::sqrt(vz * vz + 2 * 9.81 * h)) / 9.81, range = vy * t;
    while (f.state.time < t + 0.05) f.step();
    const Particles& q = f.state.particles;
    double sum = 0;
    int n = 0;
    Curve drops{digits(degrees) + " degrees, particles", {}, {}, Mark::Points},
        theory{"ballistics", {}, {}, Mark::Line};
    for (double s = 0; s < t; s += 0.01)
      theory.x.push_back(vy * s), theory.y.push_back(h + vz * s - 0.5 * 9.81 * s * s);
    for (std::size_t i = 0; i < q.count; ++i) {
      if (i % 5 == 0 && q.z[i] > -0.02f)
        drops.x.push_back(static_cast<double>(q.y[i])), drops.y.push_back(static_cast<double>(q.z[i]));
      if (std::fabs(q.z[i]) > 0.005f) continue;
      sum +=
          static_cast<double>(q.y[i]) + static_cast<double>(q.z[i]) * vy / std::sqrt(vz * vz + 2 * 9.81 * h),
          ++n;
    }
    const double error = percent(sum / n, range);
    rows.push_back({digits(degrees), digits(range), digits(sum / n), digits(error)});
    section.atMost(digits(degrees) + " degrees: range differs by", std::fabs(error), 3, "%");
    plot.curves.push_back(theory), plot.curves.push_back(drops);
  }
  section.table({"elevation, degrees", "theory, m", "particles, m", "error, %"}, rows);
  section.plot("jets", plot);
}

void plateForce(Section& section) {
  section.text("### Force on a plate");
  section.text(
      "A normal jet without gravity: rho Q v, as momentum that the tissue is told, from 0.15 to 0.5 s.");
  std::vector<std::vector<std::string>> rows;
  for (const double dt : {0.004, 0.002, 0.001}) {
    specimen::Fluid f(Parameters{}, {specimen::plate(0.15)});
    f.inputs.dt = dt;
    f.inputs.gravity = {0, 0, 0};
    f.inputs.source_count = 1;
    f.inputs.sources[0] = irrigator();
    f.inputs.sources[0].direction = {0, 0, -1};
    f.inputs.sources[0].position = {0, 0, 0.05};
    double j = 0, t = 0;
    while (f.state.time < 0.5) {
      f.step();
      if (f.state.time > 0.15) j -= f.report.tissue_momentum[2], t += dt;
    }
    const double theory = 1000 * 5e-5 * 5e-5 / f.inputs.sources[0].area, error = percent(j / t, theory);
    rows.push_back({digits(1e3 * dt), digits(theory), digits(j / t), digits(error)});
    section.atMost("steps of " + digits(1e3 * dt) + " ms: force differs by", std::fabs(error), 5, "%");
  }
  section.table({"step, ms", "theory, N", "force on the tissue, N", "error, %"}, rows);
}

void column(Section& section) {
  section.text("### Hydrostatic column");
  section.text(
      "20 mm by 20 mm, steps of 1 ms, 10 iterations. The weight of the fluid on the floor; rho g h² w/2 on "
      "one wall; the "
      "height, as twice that of the centre of mass. From 0.5 to 1 s.");
  std::vector<std::vector<std::string>> rows;
  for (const double h : {0.02, 0.04, 0.06}) {
    Parameters p;
    p.rest_time = 1e6, p.iterations = 10, p.capacity = 4000;
    specimen::Fluid f(p, {specimen::openBox(-0.01, 0.01, -0.01, 0.01, 0.1, 4)});
    f.inputs.dt = 0.001;
    f.fill(-0.01, 0.01, -0.01, 0.01, 0, h);
    f.step();
    dry(f);
    double floor = 0, wall = 0, t = 0, middle = 0;
    while (f.state.time < 1.0) {
      f.step();
      if (f.state.time < 0.5) continue;
      t += f.inputs.dt;
      floor -= f.report.tissue_momentum[2];
      for (const Impact& i : f.report.impacts)
        if (i.momentum[0] > 0 && i.triangle >= 32) wall += i.momentum[0];
    }
    const auto count = static_cast<double>(f.state.particles.count);
    for (std::size_t i = 0; i < f.state.particles.count; ++i)
      middle += static_cast<double>(f.state.particles.z[i]) / count;
    const double weight = count * f.model.whole * 1000 * 9.81, half = 0.5 * 1000 * 9.81 * h * h * 0.02;
    const double on_floor = percent(floor / t, weight), on_wall = percent(wall / t, half),
                 height = percent(2 * middle, h);
    rows.push_back(
        {digits(1e3 * h), digits(weight), digits(on_floor), digits(half), digits(on_wall), digits(height)});
    section.atMost(digits(1e3 * h) + " mm: weight on the floor differs by", std::fabs(on_floor), 1, "%");
    section.atMost(digits(1e3 * h) + " mm: force on a wall differs by", std::fabs(on_wall), 5, "%");
    section.atMost(digits(1e3 * h) + " mm: height differs by", std::fabs(height), 2, "%");
  }
  section.table({"height, mm", "weight, N", "floor, %", "wall, N", "wall, %", "height, %"}, rows);
}

void damBreak(Section& section) {
  section.text("### A dam of particles breaks");
  section.text(
      "A column 40 mm wide and twice as high, 6 iterations, 2 ms, against Martin and Moyce 1952 (Phil. "
      "Trans. R. "
      "Soc. A 244, 312-324), n² = 2, as tabulated by many later papers. The water is ahead at first, where "
      "their "
      "gate had to open.");
  const double a = 0.04;  // m
  const std::vector<std::pair<double, double>> measured{
      {0.41, 1.11}, {0.84, 1.22}, {1.19, 1.44}, {1.43, 1.67}, {1.63, 1.89}, {1.83, 2.11}, {1.98, 2.33},
      {2.20, 2.56}, {2.32, 2.78}, {2.51, 3.00}, {2.65, 3.22}, {2.83, 3.44}, {2.98, 3.67}, {3.11, 3.89}};
  Parameters p;
  p.rest_time = 1e6, p.capacity = 6000, p.iterations = 6, p.contact_angle_cosine = -1, p.friction = 0;
  specimen::Fluid f(p, {specimen::openBox(0, 4.75 * a, -0.01, 0.01, 0.1, 12)});
  f.inputs.dt = 0.002;
  f.fill(0, a, -0.01, 0.01, 0, 2 * a);
  f.step();
  dry(f);
  Curve mine{"particles, 2 mm", {}, {}, Mark::Line}, theirs{"Martin and Moyce 1952", {}, {}, Mark::Points};
  const double scale = std::sqrt(2 * 9.81 / a);  // their T = n t sqrt(g/a)
  while (f.state.time < 0.16) {
    f.step();
    std::vector<float> x(f.state.particles.x.begin(),
                         f.state.particles.x.begin() + static_cast<std::ptrdiff_t>(f.state.particles.count));
    std::nth_element(x.begin(), x.end() - 10, x.end());
    mine.x.push_back(f.state.time * scale);
    mine.y.push_back((static_cast<double>(x[x.size() - 10]) + 0.001) / a);
  }
  double worst = 0, mean = 0;
  for (const auto& [t, z] : measured) {
    theirs.x.push_back(t), theirs.y.push_back(z);
    const auto k = std::lower_bound(mine.x.begin(), mine.x.end(), t) - mine.x.begin();
    const double error = percent(mine.y[std::min(static_cast<std::size_t>(k), mine.y.size() - 1)], z);
    worst = std::max(worst, std::fabs(error)), mean += error / static_cast<double>(measured.size());
  }
  section.atMost("front differs in the mean by", std::fabs(mean), 5, "%");
  section.atMost("front differs at worst by", worst, 10, "%");
  section.plot("dam",
               {"Front of the dam break", "t sqrt(2 g/a), no unit", "front x/a, no unit", {mine, theirs}});
}

void ritter(Section& section) {
  section.text("### A dam of a pool breaks");
  section.text(
      "20 mm deep, 0.2 s after, against Ritter 1892; the tip is slower than his because the bed has "
      "friction.");
  std::vector<std::vector<std::string>> rows;
  double before = 0;
  for (const double cell : {0.008, 0.004, 0.002}) {
    Parameters p;
    p.low = {0, 0, -0.05}, p.high = {0.8, 0.02, 0.2}, p.pool_cell = cell;
    specimen::Mesh m;
    m.add({-0.01, -0.01, 0}, {0.82, 0, 0}, {0, 0.04, 0}, 4);
    specimen::Fluid f(p, {m});
    f.step();
    const int dam = static_cast<int>(0.4 / cell + 0.5);
    for (int r = 0; r < f.model.rows; ++r)
      for (int c = 0; c < dam; ++c) fillCell(f.model, f.state, c, r, 0.02 * cell * cell, 1);
    const double volume = poolVolume(f.model, f.state), c0 = std::sqrt(9.81 * 0.02);
    double t = 0, error = 0;
    while (t < 0.2) stepPools(f.model, 9.81, 0.002, f.state, f.scratch), t += 0.002;
    Curve mine{"pool, cells of 4 mm", {}, {}, Mark::Points}, theory{"Ritter 1892", {}, {}, Mark::Line};
    for (int c = 0; c < f.model.columns; ++c) {
      const double x = (c + 0.5) * cell - 0.4, s = x / t,
                   depth = static_cast<double>(f.state.pools.depth[static_cast<std::size_t>(c)]),
                   h = s < -c0 ? 0.02 : (s > 2 * c0 ? 0 : (2 * c0 - s) * (2 * c0 - s) / (9 * 9.81));
      error += std::fabs(depth - h) * cell / (0.02 * 0.4);
      mine.x.push_back(x), mine.y.push_back(depth), theory.x.push_back(x), theory.y.push_back(h);
    }
    if (cell == 0.004)
      section.plot("ritter", {"After 0.2 s", "x from the dam, m", "depth, m", {theory, mine}});
    const double change = poolVolume(f.model, f.state) / volume - 1;
    rows.push_back({digits(1e3 * cell), digits(100 * error), digits(change)});
    section.atMost("cells of " + digits(1e3 * cell) + " mm: mean deviation over the volume", 100 * error, 3,
                   "%");
    if (before > 0)
      section.atMost("halved to " + digits(1e3 * cell) + " mm: the deviation becomes", error / before, 1,
                     "of the coarser's");
    before = error;
  }
  section.table({"cell, mm", "mean deviation over the volume, %", "change of volume, no unit"}, rows);
}

}  // namespace

Section jetsSection(const Options&, const std::string& command) {
  Section section("60_jets", "Jets of irrigation", command);
  section.text(
      "Particles of 2 mm, 3 iterations and 4 ms steps, as in the trainer, unless a line says otherwise.");
  jetRange(section);
  plateForce(section);
  return section;
}

Section restSection(const Options&, const std::string& command) {
  Section section("61_columns_and_dams", "Columns and dams of fluid", command);
  column(section);
  damBreak(section);
  ritter(section);
  return section;
}

Section balanceSection(const Options& options, const std::string& command) {
  Section section("62_volume", "Volume over minutes of irrigation with suction", command);
  section.text("A basin of 12 cm for " + digits(options.minutes) +
               " minutes: water at 1 l/min and blood at 1 ml/s all the time, suction of 2.4 l/min for 10 of "
               "every 20 s.");
  Parameters p;
  p.low = {-0.08, -0.08, -0.02}, p.high = {0.08, 0.08, 0.15};
  specimen::Fluid f(p, {specimen::openBox(-0.06, 0.06, -0.06, 0.06, 0.1, 8)});
  f.inputs.source_count = 2;
  f.inputs.sources[0] = irrigator();
  f.inputs.sources[0].flow = 1.67e-5;  // 1 l/min
  f.inputs.sources[0].position = {0.03, 0, 0.05};
  f.inputs.sources[0].direction = {0.2, 0.1, -1};
  f.inputs.sources[1].slot = 1;
  f.inputs.sources[1].position = {-0.03, 0.02, 0.02};
  f.inputs.sources[1].direction = {1, 0, 0.5};
  f.inputs.sources[1].area = 1e-6;
  f.inputs.sources[1].flow = 1e-6;  // 1 ml/s of blood
  f.inputs.suctions[0].position = {-0.03, -0.03, 0.003};
  f.inputs.suctions[0].flow = 4e-5;
  Curve emitted{"emitted", {}, {}, Mark::Line}, sucked{"sucked off", {}, {}, Mark::Line},
      there{"particles and pools", {}, {}, Mark::Dashed};
  double worst = 0;
  const auto every = static_cast<long>(50 * std::max(1.0, options.minutes));
  for (long k = 0; f.state.time < 60 * options.minutes; ++k) {
    const double phase = f.state.time - 20 * std::floor(f.state.time / 20);
    f.inputs.suction_count = phase > 10 ? 1 : 0;
    f.inputs.renew_bed = k % 12 == 0;
    f.step();
    if (k % 50 == 0) worst = std::max(worst, std::fabs(f.gap()));
    if (k % every != 0) continue;
    for (Curve* c : {&emitted, &sucked, &there}) c->x.push_back(f.state.time);
    emitted.y.push_back(1e6 * f.state.emitted), sucked.y.push_back(1e6 * f.state.sucked);
    there.y.push_back(1e6 * (particleVolume(f.model, f.state) + poolVolume(f.model, f.state)));
  }
  section.table({"", "ml"},
                {{"emitted", digits(1e6 * f.state.emitted)},
                 {"sucked off", digits(1e6 * f.state.sucked)},
                 {"particles", digits(1e6 * (particleVolume(f.model, f.state) + pendingVolume(f.state)))},
                 {"pools", digits(1e6 * poolVolume(f.model, f.state))},
                 {"lost over the rim", digits(1e6 * f.state.lost)}});
  section.atMost("greatest gap in the account at any time", 100 * worst / f.state.emitted, 1,
                 "% of what was emitted");
  section.atMost("lost over the rim", 100 * f.state.lost / f.state.emitted, 1, "% of what was emitted");
  section.plot("balance", {"Irrigation and suction", "time, s", "volume, ml", {emitted, sucked, there}});
  return section;
}

}  // namespace vest::validate

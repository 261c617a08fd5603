// Validation of the fluid: runs the cases and writes docs/validation_fluids.md with its plots.

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <fstream>
#include <string>

#include <CLI/CLI.hpp>

#include "boxes.h"
#include "plot.h"

namespace {

using namespace vest::fluid;
using vest::effects::plot;
using vest::effects::Series;

std::string format(const char* pattern, ...) {
  char text[512];
  va_list list;
  va_start(list, pattern);
  std::vsnprintf(text, sizeof text, pattern, list);
  va_end(list);
  return text;
}

Source irrigator() {
  Source s;
  s.area = 3.14159265358979 * 0.0025 * 0.0025;
  s.flow = 5e-5;
  s.blood = 0;
  return s;
}

void dry(test::Fluid& f) {
  std::fill(f.state.pools.bed.begin(), f.state.pools.bed.end(), kNoBed);
}

std::string jetRange(const std::string& images) {
  std::string rows;
  std::vector<Series> series;
  const char* const colours[] = {"#1f77b4", "#d62728", "#2ca02c"};
  int colour = 0;
  for (const double degrees : {0.0, 30.0, 60.0}) {
    Parameters p;
    p.low = {-0.1, -0.2, -0.2}, p.high = {0.1, 1.2, 0.6};
    test::Fluid f(p, {});
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
    Series drops{format("%.0f degrees, particles", degrees), colours[colour], true, {}},
        theory{"ballistics", colours[colour], false, {}};
    for (double s = 0; s < t; s += 0.01) theory.at.emplace_back(vy * s, h + vz * s - 0.5 * 9.81 * s * s);
    for (std::size_t i = 0; i < q.count; ++i) {
      if (i % 5 == 0 && q.z[i] > -0.02f) drops.at.emplace_back(q.y[i], q.z[i]);
      if (std::fabs(q.z[i]) > 0.005f) continue;
      sum += q.y[i] + q.z[i] * vy / std::sqrt(vz * vz + 2 * 9.81 * h), ++n;
    }
    rows +=
        format("| %.0f° | %.4f | %.4f | %+.2f %% |\n", degrees, range, sum / n, 100 * (sum / n / range - 1));
    series.push_back(theory), series.push_back(drops);
    ++colour;
  }
  plot(images + "/fluid_jet.svg", "y, m", "z, m", series);
  return rows;
}

std::string plateForce() {
  std::string rows;
  for (const double dt : {0.004, 0.002, 0.001}) {
    test::Fluid f(Parameters{}, {test::plate(0.15)});
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
    const double theory = 1000 * 5e-5 * 5e-5 / f.inputs.sources[0].area;
    rows +=
        format("| %.0f ms | %.4f | %.4f | %+.1f %% |\n", 1e3 * dt, theory, j / t, 100 * (j / t / theory - 1));
  }
  return rows;
}

std::string column() {
  std::string rows;
  for (const double h : {0.02, 0.04, 0.06}) {
    Parameters p;
    p.rest_time = 1e6, p.iterations = 10;
    test::Fluid f(p, {test::openBox(-0.01, 0.01, -0.01, 0.01, 0.1, 4)});
    f.inputs.dt = 0.001;
    f.fill(-0.01, 0.01, -0.01, 0.01, 0, h);
    f.step();
    dry(f);
    double floor = 0, wall = 0, t = 0;
    while (f.state.time < 1.0) {
      f.step();
      if (f.state.time < 0.5) continue;
      t += f.inputs.dt;
      floor -= f.report.tissue_momentum[2];
      for (const Impact& i : f.report.impacts)
        if (i.momentum[0] > 0 && i.triangle >= 32) wall += i.momentum[0];
    }
    double top = 0;
    for (std::size_t i = 0; i < f.state.particles.count; ++i)
      top = std::max(top, static_cast<double>(f.state.particles.z[i]));
    const double weight = static_cast<double>(f.state.particles.count) * f.model.whole * 1000 * 9.81,
                 half = 0.5 * 1000 * 9.81 * h * h * 0.02;
    rows += format("| %.0f mm | %.4f | %+.2f %% | %.4f | %+.0f %% | %+.1f %% |\n", 1e3 * h, weight,
                   100 * (floor / t / weight - 1), half, 100 * (wall / t / half - 1),
                   100 * ((top + 0.001) / h - 1));
  }
  return rows;
}

std::string damBreak(const std::string& images) {
  // Martin and Moyce 1952 (Phil. Trans. R. Soc. A 244, 312–324), n² = 1, as tabulated by many later papers.
  const std::vector<std::pair<double, double>> measured{
      {0.41, 1.11}, {0.84, 1.22}, {1.19, 1.44}, {1.43, 1.67}, {1.63, 1.89}, {1.83, 2.11}, {1.98, 2.33},
      {2.20, 2.56}, {2.32, 2.78}, {2.51, 3.00}, {2.65, 3.22}, {2.83, 3.44}, {2.98, 3.67}, {3.11, 3.89}};
  Parameters p;
  p.rest_time = 1e6, p.capacity = 6000, p.iterations = 6, p.contact_angle_cosine = -1, p.friction = 0;
  test::Fluid f(p, {test::openBox(0, 0.19, -0.01, 0.01, 0.1, 12)});
  f.inputs.dt = 0.002;
  f.fill(0, 0.04, -0.01, 0.01, 0, 0.04);
  f.step();
  dry(f);
  Series mine{"particles, 2 mm", "#d62728", false, {}}, theirs{"Martin and Moyce 1952", "#1f77b4", true, {}};
  const double scale = std::sqrt(2 * 9.81 / 0.04);  // their T = t sqrt(2 g/a)
  while (f.state.time < 0.16) {
    f.step();
    std::vector<float> x(f.state.particles.x.begin(),
                         f.state.particles.x.begin() + static_cast<std::ptrdiff_t>(f.state.particles.count));
    std::nth_element(x.begin(), x.end() - 10, x.end());
    mine.at.emplace_back(f.state.time * scale, (x[x.size() - 10] + 0.001) / 0.04);
  }
  double worst = 0, mean = 0;
  int n = 0;
  for (const auto& [t, z] : measured) {
    theirs.at.emplace_back(t, z);
    for (std::size_t k = 1; k < mine.at.size(); ++k) {
      if (mine.at[k].first < t) continue;
      const double error = mine.at[k].second / z - 1;
      worst = std::max(worst, std::fabs(error)), mean += error, ++n;
      break;
    }
  }
  plot(images + "/fluid_dam.svg", "t sqrt(2 g/a)", "front x/a", {mine, theirs});
  return format("front against Martin and Moyce: mean %+.1f %%, worst %.1f %%", 100 * mean / n, 100 * worst);
}

std::string ritter(const std::string& images) {
  std::string rows;
  for (const double cell : {0.008, 0.004, 0.002}) {
    Parameters p;
    p.low = {0, 0, -0.05}, p.high = {0.8, 0.02, 0.2}, p.pool_cell = cell;
    test::Mesh m;
    m.add({-0.01, -0.01, 0}, {0.82, 0, 0}, {0, 0.04, 0}, 4);
    test::Fluid f(p, {m});
    f.step();
    const int dam = static_cast<int>(0.4 / cell + 0.5);
    for (int r = 0; r < f.model.rows; ++r)
      for (int c = 0; c < dam; ++c) fillCell(f.model, f.state, c, r, 0.02 * cell * cell, 1);
    const double volume = poolVolume(f.model, f.state), c0 = std::sqrt(9.81 * 0.02);
    double t = 0, error = 0;
    while (t < 0.2) stepPools(f.model, 9.81, 0.002, f.state, f.scratch), t += 0.002;
    Series mine{format("pool, cell %.0f mm", 1e3 * cell), "#d62728", true, {}},
        theory{"Ritter 1892", "#1f77b4", false, {}};
    for (int c = 0; c < f.model.columns; ++c) {
      const double x = (c + 0.5) * cell - 0.4, s = x / t,
                   h = s < -c0 ? 0.02 : (s > 2 * c0 ? 0 : (2 * c0 - s) * (2 * c0 - s) / (9 * 9.81));
      error += std::fabs(f.state.pools.depth[static_cast<std::size_t>(c)] - h) * cell;
      mine.at.emplace_back(x, f.state.pools.depth[static_cast<std::size_t>(c)]);
      theory.at.emplace_back(x, h);
    }
    if (cell == 0.004)
      plot(images + "/fluid_ritter.svg", "x from the dam, m", "depth, m, after 0.2 s", {theory, mine});
    rows += format("| %.0f mm | %.2f %% | %.1e |\n", 1e3 * cell, 100 * error / (0.02 * 0.4),
                   poolVolume(f.model, f.state) / volume - 1);
  }
  return rows;
}

std::string balance(const std::string& images, double minutes) {
  Parameters p;
  p.low = {-0.08, -0.08, -0.02}, p.high = {0.08, 0.08, 0.15};
  test::Fluid f(p, {test::openBox(-0.06, 0.06, -0.06, 0.06, 0.1, 8)});
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
  Series emitted{"emitted", "#1f77b4", false, {}}, sucked{"sucked off", "#2ca02c", false, {}},
      there{"particles and pools", "#d62728", false, {}};
  double worst = 0;
  for (long k = 0; f.state.time < 60 * minutes; ++k) {
    const double phase = f.state.time - 20 * std::floor(f.state.time / 20);
    f.inputs.suction_count = phase > 10 ? 1 : 0;
    f.inputs.renew_bed = k % 12 == 0;
    f.step();
    if (k % 50 == 0) {
      worst = std::max(worst, std::fabs(f.gap()));
      emitted.at.emplace_back(f.state.time, 1e6 * f.state.emitted);
      sucked.at.emplace_back(f.state.time, 1e6 * f.state.sucked);
      there.at.emplace_back(f.state.time,
                            1e6 * (particleVolume(f.model, f.state) + poolVolume(f.model, f.state)));
    }
  }
  plot(images + "/fluid_balance.svg", "t, s", "ml", {emitted, sucked, there});
  return format(
      "| emitted | %.2f ml |\n| sucked off | %.2f ml |\n| particles | %.3f ml |\n| pools | %.2f ml |\n| lost "
      "over the rim | %.3f ml |\n"
      "| greatest gap in the account at any time | %.1e of what was emitted |\n",
      1e6 * f.state.emitted, 1e6 * f.state.sucked, 1e6 * (particleVolume(f.model, f.state) + pendingVolume(f.state)),
      1e6 * poolVolume(f.model, f.state), 1e6 * f.state.lost, worst / f.state.emitted);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Runs the fluid's validation cases and writes docs/validation_fluids.md"};
  std::string docs;
  double minutes = 5;
  app.add_option("--docs", docs, "folder docs of the repository")->required()->check(CLI::ExistingDirectory);
  app.add_option("--minutes", minutes, "of the volume balance")->check(CLI::Range(0.1, 60.0));
  CLI11_PARSE(app, argc, argv);
  const std::string images = docs + "/images";
  std::ofstream out(docs + "/validation_fluids.md");
  if (!out) return std::fprintf(stderr, "fluid_validation: cannot write to %s\n", docs.c_str()), 1;
  out << "# Validation of the fluids\n\nWritten by `rosrun vest_effects vest_effects_fluid_validation --docs "
         "docs`. Particles of 2 mm, "
         "3 iterations and 4 ms steps, as in the trainer, unless a line says otherwise.\n\n"
         "## Range of a jet against ballistics\n\n3 l/min through 5 mm (2.546 m/s), 0.15 m above the level "
         "where it is caught.\n\n"
         "| elevation | theory, m | particles, m | error |\n| --- | --- | --- | --- |\n"
      << jetRange(images)
      << "\n![Jets](images/fluid_jet.svg)\n\n## Force of a jet on a plate\n\nA normal jet without gravity: "
         "rho Q v.\n\n"
      << "| step | theory, N | force on the tissue, N | error |\n| --- | --- | --- | --- |\n"
      << plateForce()
      << "\n## Hydrostatic column\n\n20 mm × 20 mm, steps of 1 ms, 10 iterations. The weight of the fluid on "
         "the floor; rho g h² w/2 on one wall "
         "(the first layer of particles lies half a spacing before the wall, 5 to 10 % of these heights); "
         "the height that remains.\n\n"
      << "| height | weight, N | floor | wall, N | wall | height |\n| --- | --- | --- | --- | --- | --- |\n"
      << column() << "\n## A dam breaks\n\nParticles: a square section of 40 mm, 6 iterations, 2 ms; ";
  out << damBreak(images) << ".\n\n![Dam break of particles](images/fluid_dam.svg)\n\n"
      << "Pools: 20 mm deep, 0.2 s after; the tip is slower than Ritter's because the bed has friction.\n\n"
      << "| cell | mean deviation over the volume | change of volume |\n| --- | --- | --- |\n"
      << ritter(images) << "\n![Dam break of a pool](images/fluid_ritter.svg)\n\n";
  out << format("## Volume over %.0f minutes of irrigation with suction\n\n", minutes)
      << "A basin of 12 cm: water at 1 l/min and blood at 1 ml/s all the time, suction of 2.4 l/min for 10 "
         "of every 20 s.\n\n| | |\n| --- | --- |\n"
      << balance(images, minutes) << "\n![Balance](images/fluid_balance.svg)\n";
  std::printf("%s/validation_fluids.md\n", docs.c_str());
  return 0;
}

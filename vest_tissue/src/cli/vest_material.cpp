#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_instruments/files/read.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/validation/svg_plot.h"

namespace {

using namespace vest;
using material::Condition;

void list(const material::Database& database) {
  std::printf("%-14s %12s %8s %8s %8s %10s %8s %10s\n", "material", "E, Pa", "a2", "a3", "a4", "max strain",
              "nu", "kg/m3");
  for (const auto& t : database.tissues) {
    for (const Condition c : {Condition::InVivo, Condition::PostMortem}) {
      const auto law = t.law(c);
      std::printf("%-14s %12.5g %8.3g %8.3g %8.3g %10.3g %8.3g %10.4g  %s%s\n",
                  c == Condition::InVivo ? t.name.c_str() : "", law.youngs_modulus, law.a2, law.a3, law.a4,
                  law.max_strain, t.at("poisson_ratio", c).value, t.at("density", c).value,
                  c == Condition::InVivo ? "in vivo" : "post mortem",
                  t.at("youngs_modulus", c).assumed ? ", E assumed" : "");
    }
  }
}

/// A text of the database: it may be a stranger's.
std::string shown(const std::string& text) {
  return files::shown(text, 2000);
}

void show(const material::Tissue& t) {
  std::printf("%s\n", t.name.c_str());
  for (const Condition c : {Condition::InVivo, Condition::PostMortem}) {
    std::printf("  %s\n", c == Condition::InVivo ? "in vivo" : "post mortem");
    for (const auto& [key, q] : c == Condition::InVivo ? t.in_vivo : t.post_mortem) {
      std::printf("    %-21s %-10.6g %-9s ", key.c_str(), q.value, q.unit.c_str());
      if (q.assumed)
        std::printf("assumed: %s\n", shown(q.source).c_str());
      else
        std::printf("%s; %s: \"%s\"; strain: %s\n", shown(q.source).c_str(), shown(q.place).c_str(),
                    shown(q.quoted).c_str(), shown(q.strain).c_str());
    }
  }
  std::printf("    the others: %s\n", shown(t.others).c_str());
}

void write(const std::string& path, const std::string& bytes) {
  std::ofstream out(path, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw std::runtime_error("--output: " + path + " cannot be written");
}

validation::Curve curveOf(const material::Law& law, double from, double to, const std::string& label) {
  validation::Curve c;
  c.label = label;
  for (int i = 0; i <= 120; ++i) {
    const double strain = from + (to - from) * i / 120;
    c.x.push_back(strain);
    c.y.push_back(1e-3 * material::stress(law, strain));
  }
  return c;
}

void plot(const material::Tissue& t, const std::string& path) {
  validation::Plot p;
  p.title = t.name + ": stress and strain";
  p.x_label = "strain, no unit", p.y_label = "stress, kPa";
  const auto living = t.law(Condition::InVivo), dead = t.law(Condition::PostMortem);
  p.curves.push_back(curveOf(living, material::kCompressiveRange, living.max_strain, "in vivo"));
  p.curves.push_back(curveOf(dead, material::kCompressiveRange, dead.max_strain, "post mortem"));
  p.curves.back().mark = validation::Mark::Dashed;
  write(path, validation::toSvg(p));
}

int fit(const std::string& file, int terms, const std::string& output) {
  const auto points = material::readCurve(file);
  material::Fit f;
  try {
    f = material::fitLaw(points, terms);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(file + ": " + error.what());
  }
  std::printf("points    %zu, strain %.4g … %.4g\n", points.size(), f.least_strain, f.greatest_strain);
  std::printf("E         %.6g Pa\na2        %.6g\na3        %.6g\na4        %.6g\n", f.law.youngs_modulus,
              f.law.a2, f.law.a3, f.law.a4);
  std::printf("residual  %.4g Pa root mean square, %.4g Pa at most, R2 %.6f\n", f.rms, f.greatest,
              f.determination);
  if (!f.monotone)
    std::printf(
        "%s: the law falls somewhere below strain %.4g: a scene would be refused; use fewer --terms\n",
        vest::files::shown(file, 6000).c_str(), f.law.max_strain);
  if (output.empty()) return f.monotone ? 0 : 1;
  validation::Plot p;
  p.title = "fit of the fourth-order law";
  p.x_label = "strain, no unit", p.y_label = "stress, kPa";
  validation::Curve measured{"measured", {}, {}, validation::Mark::Points};
  for (const auto& point : points)
    measured.x.push_back(point.strain), measured.y.push_back(1e-3 * point.stress);
  p.curves.push_back(measured);
  p.curves.push_back(curveOf(f.law, std::min(0.0, f.least_strain), f.greatest_strain, "fit"));
  write(output, validation::toSvg(p));
  return f.monotone ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tissue material: what the database holds, its curves, and a law for a measured one.");
  app.require_subcommand(1);
  std::string database, name, output, file;
  int terms = 4;
  app.add_option("--materials", database, "material database (default: the shipped one)");
  CLI::App* listing = app.add_subcommand("list", "all materials, in vivo and post mortem");
  CLI::App* showing = app.add_subcommand("show", "every number of a material with its source");
  showing->add_option("NAME", name)->required();
  CLI::App* plotting = app.add_subcommand("plot", "stress over strain as SVG");
  plotting->add_option("NAME", name)->required();
  plotting->add_option("--output", output, "FILE.svg")->required();
  CLI::App* fitting =
      app.add_subcommand("fit", "E, a2, a3, a4 for a measured curve: CSV with columns strain,stress (Pa)");
  fitting->add_option("CURVE", file, "CURVE.csv")->required();
  fitting->add_option("--terms", terms, "coefficients: 1 (E) … 4 (E, a2, a3, a4)")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  fitting->add_option("--output", output, "FILE.svg: the points and the fit");
  CLI11_PARSE(app, argc, argv);
  try {
    if (fitting->parsed()) return fit(file, terms, output);
    const auto read = material::readDatabase(database.empty() ? material::databasePath() : database);
    if (listing->parsed()) list(read);
    if (showing->parsed()) show(read.at(name));
    if (plotting->parsed()) plot(read.at(name), output);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_material: %s\n", vest::files::shown(error.what(), 6000).c_str());
    return 1;
  }
}

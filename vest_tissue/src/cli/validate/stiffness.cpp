#include <algorithm>
#include <cmath>

#include "sections.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::validate {
namespace {

using Eigen::Vector3d;
using validation::digits;

/// Knots in a row along x, held at the first.
scene::Description chain(double mass, double k, double dt, double gravity) {
  scene::Description d;
  d.name = "chain";
  d.gravity = {gravity, 0, 0};
  d.dt = dt;
  scene::Object o;
  o.name = "chain";
  for (int i = 0; i < 6; ++i) {
    o.rest_position.emplace_back(0.01 * i, 0, 0);
    o.mass.push_back(mass);
    o.damping.push_back(20.0 * mass);
    o.fixed.push_back(i == 0);
    if (i == 0) continue;
    scene::Link l;
    l.knot0 = i - 1, l.knot1 = i, l.rest = 0.01, l.stiffness = k;
    o.links.push_back(l);
  }
  o.position = o.rest_position;
  d.objects.push_back(o);
  return d;
}

}  // namespace

validation::Section stiffnessSection(const Options&, const std::string& command) {
  validation::Section s("14_stiffness", "Nets: any stiffness, mass and step", command);
  s.text(
      "A chain of five knots hangs by its weight; each link carries what is below it. What explicit "
      "sub-steps "
      "cannot hold is stepped by backward Euler\n(docs/decisions/0012-implicit-nets.md). "
      "Beyond 10⁶ the sag is less than the rounding of a float position (6 nm here).");
  std::vector<std::vector<std::string>> rows;
  double worst = 0.0;
  for (int power = 0; power <= 12; power += 2) {
    const double k = 20.0 * std::pow(10.0, power);
    scene::World w(chain(1e-3, k, 1e-3, 9.81));
    scene::StepInput in;
    scene::StepReport report;
    for (int i = 0; i < 2000; ++i) w.step(in, report);
    std::vector<float> p(3 * w.knotCount(0));
    w.positions(0, p.data());
    const double sag = p[15] - 0.05, expected = 15.0 * 1e-3 * 9.81 / k;
    worst = std::max(worst, std::max(0.0, std::fabs(sag - expected) - 1e-8) / expected);
    rows.push_back({"1e" + std::to_string(power), w.model().objects[0].implicit ? "implicit" : "explicit",
                    digits(1e3 * sag), digits(1e3 * expected)});
    if (power >= 6) worst = std::fabs(sag - expected) < 1e-8 ? worst : NAN;
  }
  s.table({"stiffness, times 20 N/m", "step", "sag, mm", "theory, mm"}, rows);
  s.atMost("sag against theory, beyond 10 nm of rounding", 100 * worst, 0.1, "%");

  s.text(
      "The same chain turned across its weight (it falls and swings), for stiffness ×10⁰ … 10¹², mass ×1 … "
      "10⁻¹⁵ and dt of 1 µs … 10 ms.");
  double fastest = 0.0;
  int runs = 0;
  for (const double dt : {1e-6, 1e-4, 1e-3, 1e-2})
    for (int power = 0; power <= 12; power += 4)
      for (const double mass : {1e-3, 1e-9, 1e-18}) {
        auto d = chain(mass, 20.0 * std::pow(10.0, power), dt, 0.0);
        d.gravity = {0, 0, -9.81};
        scene::World w(d);
        scene::StepInput in;
        in.dt = dt;
        scene::StepReport report;
        std::vector<float> v(3 * w.knotCount(0));
        const int steps = static_cast<int>(std::min(200.0, std::ceil(0.3 / dt)));
        for (int i = 0; i < steps; ++i) {
          if (w.step(in, report) == scene::Status::Fault) fastest = NAN;
          w.velocities(0, v.data());
          for (const float u : v) fastest = std::isfinite(u) ? std::max(fastest, double(std::fabs(u))) : NAN;
        }
        ++runs;
      }
  // Energy: no knot can be faster than all of the chain's fall of 2·0.05 m in one knot.
  s.atMost("greatest speed in " + std::to_string(runs) + " runs", fastest, std::sqrt(2 * 9.81 * 0.05 * 2 * 5),
           "m/s");
  return s;
}

}  // namespace vest::validate

#include <algorithm>
#include <cmath>

#include "sections.h"
#include "vest_tissue/scene/world.h"

namespace vest::validate {
namespace {

using Eigen::Vector3d;

/// A ring of knots with cross links and bending, free, stretched out of shape and turning.
scene::Description ring() {
  scene::Description d;
  d.name = "ring";
  d.gravity.setZero();
  scene::Object o;
  o.name = "ring";
  constexpr int kKnots = 12;
  for (int i = 0; i < kKnots; ++i) {
    const double phi = 2 * M_PI * i / kKnots;
    o.rest_position.emplace_back(0.02 * std::cos(phi), 0.02 * std::sin(phi), 0.002 * (i % 2));
    o.position.push_back(o.rest_position.back() * (1.0 + 0.08 * std::sin(2 * phi)));
    o.mass.push_back(1e-3 * (1 + i % 3));
    o.damping.push_back(0.0);
    o.fixed.push_back(0);
  }
  for (int i = 0; i < kKnots; ++i)
    for (const int to : {1, 2, 6}) {
      scene::Link l;
      l.knot0 = static_cast<scene::Index>(i), l.knot1 = static_cast<scene::Index>((i + to) % kKnots);
      if (to == 6 && i >= 6) continue;
      l.rest = (o.rest_position[l.knot0] - o.rest_position[l.knot1]).norm();
      l.area = 1e-6;
      o.links.push_back(l);
    }
  o.law = {3e5, 1.0, 4.0, 8.0, 0.5};
  d.objects.push_back(o);
  return d;
}

}  // namespace

validation::Section conservationSection(const Options&, const std::string& command) {
  validation::Section s("13_conservation", "Nets: momentum and energy without damping", command);
  constexpr int kSteps = 100000;
  s.text(
      "A free net with the fourth-order law, stretched out of shape, no damping and no gravity, for 10⁵ "
      "steps of 1 ms.");
  const auto d = ring();
  scene::World w(d);
  scene::StepInput in;
  scene::StepReport report;
  validation::Curve energy{"kinetic + elastic", {}, {}, validation::Mark::Line};
  double start = 0.0, most = 0.0, momentum = 0.0, size = 0.0, late = 0.0, early = 0.0;
  std::vector<float> v(3 * w.knotCount(0));
  for (int i = 0; i < kSteps; ++i) {
    if (w.step(in, report) != scene::Status::Ok) most = NAN;
    if (i % 97 != 0) continue;
    const auto e = w.energy();
    const double total = e.kinetic + e.elastic;
    if (i == 0) start = total;
    most = std::isnan(most) ? most : std::max(most, std::fabs(total / start - 1.0));
    (i < kSteps / 10 ? early : late) = std::max(i < kSteps / 10 ? early : late, total / start);
    if (i % (97 * 8) == 0) energy.x.push_back(1e-3 * i), energy.y.push_back(1e6 * total);
    w.velocities(0, v.data());
    Vector3d p = Vector3d::Zero();
    double sum = 0.0;
    for (std::size_t k = 0; k < d.objects[0].mass.size(); ++k) {
      const Vector3d u(v[3 * k], v[3 * k + 1], v[3 * k + 2]);
      p += d.objects[0].mass[k] * u;
      sum += d.objects[0].mass[k] * u.norm();
    }
    momentum = std::max(momentum, p.norm());
    size = std::max(size, sum);
  }
  s.plot("energy", {"Energy of a free net without damping", "time, s", "energy, µJ", {energy}, false, false});
  s.atMost("net momentum over the sum of all knots' momenta", momentum / size, 1e-4, "no unit");
  s.atMost("energy: greatest deviation from the start in 10⁵ steps", 100 * most, 5.0, "%");
  s.atMost("energy: greatest of the last nine tenths over greatest of the first tenth", late / early, 1.02,
           "no unit");
  return s;
}

}  // namespace vest::validate

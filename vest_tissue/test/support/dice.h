#pragma once

#include <cstdint>
#include <random>

#include "blades.h"
#include "slab.h"

namespace vest::test {

/// Objects and operations, from a seed alone.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}

  double uniform(double low, double high) { return low + (high - low) * (random_() / 4294967296.0); }
  int choose(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }

  scene::Description net() {
    if (choose(2) == 0) {
      specimen::BarOptions o;
      o.columns = 7 + choose(6), o.rows = 2 + choose(2);
      o.spacing = uniform(0.0025, 0.004), o.thickness = uniform(0.002, 0.006);
      o.youngs_modulus = uniform(5e3, 50e3), o.bulk_modulus = choose(3) == 0 ? 0.0 : 2e4;
      o.fix_right = choose(2) == 0;
      return specimen::barScene(o);
    }
    specimen::TubeOptions o;
    o.rings = 8 + choose(8), o.around = 5 + choose(4);
    o.length = 0.05, o.radius = uniform(0.002, 0.004);
    o.youngs_modulus = uniform(5e3, 50e3);
    scene::Description d = specimen::tubeScene(o);
    d.objects[0].wall_thickness = 0.001;
    return d;
  }

  /// A bar of tetrahedra held at one end: small strain or corotational, in motion or elastostatic.
  scene::Description volume() {
    fem::specimen::Box box{6 + choose(4), 2 + choose(2), 2, 0.04, 0.008, uniform(0.003, 0.006)};
    fem::Description d = fem::specimen::makeBox(box);
    d.name = "volume";
    const int kind = choose(3);
    d.motion = kind == 2 ? fem::Motion::Elastostatic : fem::Motion::BackwardEuler;
    d.strain = kind == 1 ? fem::Strain::Corotational : fem::Strain::Small;
    d.material = {uniform(20e3, 200e3), uniform(0.3, 0.45), 1050.0, 4.0, 0.004};
    for (auto& x : d.nodes) x += Eigen::Vector3d(-0.02, -0.004, 0.05 - 0.5 * 0.004);
    return fem::specimen::sceneOf({fem::specimen::object(d)});
  }

  scene::ToolInput pose(tools::ToolKind kind, double jaw) {
    const Eigen::Vector3d along(uniform(-0.7, 0.7), uniform(-0.7, 0.7),
                                -1.0);  // from above, as through a trocar
    const Eigen::Vector3d opening(uniform(-0.3, 0.3), 1.0, uniform(-0.3, 0.3));
    const Eigen::Vector3d middle(uniform(-0.018, 0.018), uniform(-0.003, 0.003), uniform(0.048, 0.052));
    double beyond = uniform(-0.002, 0.008);
    if (kind == tools::ToolKind::Scissors) beyond = uniform(0.003, 0.011);
    if (kind == tools::ToolKind::CoagulationHook) beyond = uniform(-0.014, 0.0);
    if (kind == tools::ToolKind::SlingApplicator) beyond = uniform(-0.033, -0.027);
    return specimen::toolAt(kind, middle + beyond * along.normalized(), along, opening, jaw);
  }

 private:
  std::mt19937 random_;
};

}  // namespace vest::test

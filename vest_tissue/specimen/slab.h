#pragma once

#include "beam.h"
#include "nets.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/world.h"

namespace vest::fem::specimen {

/// A soft slab, 60 × 40 × 12 mm, its underside held, centred about the z axis; top at z = 12 mm.
struct SlabOptions {
  Strain strain = Strain::Small;
  Motion motion = Motion::BackwardEuler;
  double youngs_modulus = 5400.0;  // Pa
  double density = 1050.0;         // kg/m³
  int nx = 10, ny = 7, nz = 3;
  bool hold = true;
  std::string name = "slab";
};

inline Description slab(const SlabOptions& o = {}) {
  Description d = makeBox({o.nx, o.ny, o.nz, 0.06, 0.04, 0.012}, false);
  d.name = o.name;
  d.strain = o.strain;
  d.motion = o.motion;
  d.material = {o.youngs_modulus, 0.45, o.density, 1.0, 0.002};
  for (Index n = 0; n < d.nodes.size(); ++n) {
    if (o.hold && d.nodes[n].z() == 0.0) d.fixed.push_back(n);
    d.nodes[n] -= Eigen::Vector3d(0.03, 0.02, 0.0);
  }
  return d;
}

inline scene::Object object(const Description& d) {
  scene::Object o;
  o.name = d.name;
  o.model = scene::ObjectModel::Fem;
  o.fem = std::make_shared<const Description>(d);
  scene::completeFem(o);
  return o;
}

inline scene::Description sceneOf(const std::vector<scene::Object>& objects) {
  scene::Description s;
  s.name = "fem";
  s.hash = "00000000000000fe";
  s.objects = objects;
  return s;
}

inline std::vector<float> positionsOf(const scene::World& w, std::size_t object) {
  std::vector<float> x(3 * w.knotCount(object));
  w.positions(object, x.data());
  return x;
}

}  // namespace vest::fem::specimen

#include "hinge_kernel_body.h"
#include "knot_loops_body.h"
#include "link_kernel_body.h"
#include "pack_baseline.h"

namespace vest::net::kernel {

void addLinkForcesBaseline(const LinkTable& table, const KnotArrays& knots) {
  if (table.law().straight()) {
    addRunForces<Pack, true>(table, knots);
    addIndexedForces<Pack, true>(table, knots);
  } else {
    addRunForces<Pack, false>(table, knots);
    addIndexedForces<Pack, false>(table, knots);
  }
}
const KnotLoops kKnotLoopsBaseline = loopsOf<Pack>();
void integrateKnotsBaseline(const MotionArrays& a, float dt) {
  integrateKnots<Pack>(a, dt);
}
void addHingesBaseline(const std::vector<Hinge>& hinges, const ElementArrays& a) {
  addHinges<Pack>(hinges, a);
}

}  // namespace vest::net::kernel

#include "hinge_kernel_body.h"
#include "link_kernel_body.h"
#include "pack_baseline.h"

namespace vest::net::kernel {

void addLinkForcesBaseline(const LinkTable& table, const KnotArrays& knots) {
  addRunForces<Pack>(table, knots);
  addIndexedForces<Pack>(table, knots);
}
void integrateKnotsBaseline(const MotionArrays& a, float dt) {
  integrateKnots<Pack>(a, dt);
}
void addHingesBaseline(const std::vector<Hinge>& hinges, const ElementArrays& a) {
  addHinges<Pack>(hinges, a);
}

}  // namespace vest::net::kernel

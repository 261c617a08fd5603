// Built with -mavx2 and without FMA: see CMakeLists.txt. Called only where the processor has AVX2.
#include "hinge_kernel_body.h"
#include "knot_loops_body.h"
#include "link_kernel_body.h"
#include "link_kernel_packed.h"
#include "pack_avx2.h"

namespace vest::net::kernel {

namespace {

template <bool kStraight>
void addAllForces(const LinkTable& table, const KnotArrays& knots) {
  addRunForces<Pack, kStraight>(table, knots);
  // Packing costs about as much as a link for each knot.
  if (knots.packed != nullptr && table.indexedBlocks() * kLanes > table.indexedKnots() / 2)
    addPackedForces<kStraight>(table, knots);
  else
    addIndexedForces<Pack, kStraight>(table, knots);
}

}  // namespace

void addLinkForcesAvx2(const LinkTable& table, const KnotArrays& knots) {
  table.law().straight() ? addAllForces<true>(table, knots) : addAllForces<false>(table, knots);
}
const KnotLoops kKnotLoopsAvx2 = loopsOf<Pack>();
void integrateKnotsAvx2(const MotionArrays& a, float dt) {
  integrateKnots<Pack>(a, dt);
}
void addHingesAvx2(const std::vector<Hinge>& hinges, const ElementArrays& a) {
  addHinges<Pack>(hinges, a);
}

}  // namespace vest::net::kernel

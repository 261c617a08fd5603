#include <cmath>
#include <cstring>

#include "kernel_levels.h"

namespace vest::net {
namespace {

#include "kernel_body.h"

}  // namespace

const Kernel& avx2Kernel() {
  static constexpr Kernel kLevel{"avx2", &linkForces, &integrateKnots};
  return kLevel;
}

}  // namespace vest::net

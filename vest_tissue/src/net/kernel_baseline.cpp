#include <cmath>
#include <cstring>

#include "kernel_levels.h"

namespace vest::net {
namespace {

#include "kernel_body.h"

}  // namespace

const Kernel& baselineKernel() {
  static constexpr Kernel kLevel{"baseline", &linkForces, &integrateKnots};
  return kLevel;
}

}  // namespace vest::net

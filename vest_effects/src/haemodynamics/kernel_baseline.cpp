#include <cmath>
#include <cstring>
#include <limits>

#include "kernel.h"

namespace vest::haemodynamics::kernel {

namespace {
#include "kernel_body.inc"
}  // namespace

const Kernels kBaseline = {"baseline", fluxes, update, survey, stray};

}  // namespace vest::haemodynamics::kernel

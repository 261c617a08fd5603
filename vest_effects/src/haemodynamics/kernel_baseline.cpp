#include <cmath>

#include "kernel.h"

namespace vest::haemodynamics::kernel {

namespace {
#include "kernel_body.inc"
}  // namespace

const Kernels kBaseline = {"baseline", fluxes, update};

}  // namespace vest::haemodynamics::kernel

#include <cmath>

#include "lanes.h"

namespace vest::fluid {
namespace {
#include "density_body.inc"
}  // namespace

const Kernels kAvx2 = {"avx2", lists, lambdas, corrections, diffusions};

}  // namespace vest::fluid

#include <cmath>

#include "lanes.h"

namespace vest::fluid {
namespace {
#include "density_body.inc"
}  // namespace

const Kernels kBaseline = {"baseline", lists, lambdas, corrections, diffusions};

}  // namespace vest::fluid

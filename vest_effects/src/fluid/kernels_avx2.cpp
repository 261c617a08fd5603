#include <algorithm>
#include <cmath>

#include "lanes.h"
#include "triangle.h"

namespace vest::fluid {
namespace {
#include "density_body.inc"
#include "planes_body.inc"
#include "pools_body.inc"
}  // namespace

const Kernels kAvx2 = {"avx2", lists, lambdas, corrections, diffusions, meet, planes, flow};

}  // namespace vest::fluid

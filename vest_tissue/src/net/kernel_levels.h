#pragma once

#include "vest_tissue/net/kernel.h"

namespace vest::net {

const Kernel& baselineKernel();
const Kernel& avx2Kernel();

}  // namespace vest::net

#include <cstdlib>
#include <cstring>

#include "kernel.h"
#include "vest_effects/haemodynamics/kernel_level.h"

namespace vest::haemodynamics::kernel {

const Kernels& selected() {
  static const Kernels& chosen = []() -> const Kernels& {
#ifdef VEST_HAS_AVX2_KERNEL
    const char* wish = std::getenv("VEST_KERNEL");
    if (__builtin_cpu_supports("avx2") && !(wish && std::strcmp(wish, "baseline") == 0)) return kAvx2;
#endif
    return kBaseline;
  }();
  return chosen;
}

}  // namespace vest::haemodynamics::kernel

namespace vest::haemodynamics {

const char* kernelLevel() {
  return kernel::selected().level;
}

}  // namespace vest::haemodynamics

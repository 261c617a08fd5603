#include "vest_tissue/net/kernel.h"

#include <cstdlib>
#include <cstring>

#include "kernel_levels.h"

namespace vest::net {

const Kernel* kernelByName(const char* name) {
  if (std::strcmp(name, "baseline") == 0) return &baselineKernel();
#ifdef VEST_TISSUE_HAVE_AVX2
  if (std::strcmp(name, "avx2") == 0 && __builtin_cpu_supports("avx2")) return &avx2Kernel();
#endif
  return nullptr;
}

const Kernel& kernel() {
  static const Kernel* const chosen = [] {
    if (const char* wanted = std::getenv("VEST_KERNEL"); wanted != nullptr && *wanted != '\0') {
      const Kernel* found = kernelByName(wanted);
      return found != nullptr ? found : kernelByName("baseline");
    }
    const Kernel* best = kernelByName("avx2");
    return best != nullptr ? best : kernelByName("baseline");
  }();
  return *chosen;
}

}  // namespace vest::net

#include "product.h"

#include <vector>

namespace vest::fem {

void subtract(const Product& product) {
  thread_local std::vector<double> room(kernel::kRoom);
#if defined(VEST_HAVE_AVX2_KERNEL)
  static const bool wide = __builtin_cpu_supports("avx2") != 0;
  if (wide) return kernel::subtractAvx2(product, room.data());
#endif
  kernel::subtractBaseline(product, room.data());
}

}  // namespace vest::fem

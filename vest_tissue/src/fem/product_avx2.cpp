// Built with -mavx2 and without FMA: see CMakeLists.txt. Called only where the processor has AVX2.
#include "product_body.h"

namespace vest::fem::kernel {
namespace {
typedef double Lane __attribute__((vector_size(32)));
}

void subtractAvx2(const Product& product, double* room) {
  subtractBy<Lane>(product, room);
}

}  // namespace vest::fem::kernel

#include "product_body.h"

namespace vest::fem::kernel {
namespace {
typedef double Lane __attribute__((vector_size(16)));
}

void subtractBaseline(const Product& product, double* room) {
  subtractBy<Lane>(product, room);
}

}  // namespace vest::fem::kernel

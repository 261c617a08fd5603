#pragma once

#include <vector>

#include "vest_tissue/suture/rod.h"

/// Threads that touch themselves, each other, and cylinders.
namespace vest::suture {

struct ContactScratch {
  explicit ContactScratch(const Model&) {}
};

inline std::size_t contactRoom(const Model&) {
  return 0;
}

}  // namespace vest::suture

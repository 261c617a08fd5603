/// Counts what the calling thread allocates, and refuses nothing. Include in one file of an executable.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <new>

namespace vest::haptics::testing {
inline thread_local std::uint64_t allocations = 0;
}

extern "C" void* __libc_malloc(std::size_t);
extern "C" void* malloc(std::size_t size) {  // also what operator new and C libraries ask for
  ++vest::haptics::testing::allocations;
  return __libc_malloc(size);
}

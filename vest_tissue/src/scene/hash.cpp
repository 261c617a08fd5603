#define XXH_STATIC_LINKING_ONLY  // the state by value: no allocation
#include <xxhash.h>

#include "state_bytes.h"
#include "world_impl.h"

namespace vest::scene {
namespace {

struct HashArchive {
  XXH64_state_t state{};
  HashArchive() { XXH64_reset(&state, 0); }
  void bytes(const void* data, std::size_t size) {
    if (size > 0) XXH64_update(&state, data, size);
  }
  template <typename T>
  void resize(std::vector<T>&, std::size_t size) {
    same(size);
  }
  template <typename T>
  void numbers(const T*, std::size_t) {}
  void same(std::uint64_t size) { bytes(&size, sizeof size); }
  void within(std::int32_t, std::int32_t) {}
  void setCounts(ObjectState&, std::uint64_t, std::uint64_t) {}
  void room(std::size_t, std::size_t) {}
  void repack(ObjectState&) {}
};

}  // namespace

std::uint64_t World::stateHash() const {
  HashArchive archive;
  // The walker also reads snapshots, so that it takes the State by reference; hashing writes nothing.
  StateWalker<HashArchive>{archive}.world(const_cast<WorldState&>(impl_->state));
  return XXH64_digest(&archive.state);
}

}  // namespace vest::scene

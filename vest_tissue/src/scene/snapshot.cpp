#define XXH_STATIC_LINKING_ONLY  // the hash's state by value: no allocation
#include <xxhash.h>

#include "state_archives.h"
#include "vest_instruments/files/read.h"
#include "world_impl.h"

namespace vest::scene {
namespace {

struct Hasher : Archive {
  XXH64_state_t state{};
  template <class T>
  void values(const T* v, std::size_t count, const Limits&) {
    if (count > 0) XXH64_update(&state, v, count * sizeof(T));
  }
  void count(std::uint64_t n, std::size_t, const Limits& l) { values(&n, 1, l); }
};

/// Archives also read, so that a walk takes the State by reference; these write nothing to it.
WorldState& toRead(const WorldState& state) {
  return const_cast<WorldState&>(state);
}

}  // namespace

void repack(ObjectState& s) {
  std::size_t by_law = 0;
  for (const NetLink& l : s.links) by_law += l.by_law;
  s.law_links.dropLinks(by_law), s.linear_links.dropLinks(s.links.size() - by_law);
  for (const NetLink& l : s.links) {
    net::LinkTable& table = l.by_law ? s.law_links : s.linear_links;
    if (l.place > table.linkCount() || (l.place == table.linkCount() && !table.addLink(l.values)))
      refuse("a link of an object has no place");
    table.setLink(l.place, l.values.rest, l.values.axial, l.values.damping);
  }
  s.law_links.setMaxStrain(s.limit_strain);
}

std::uint64_t World::stateHash() const {
  Hasher hasher{{{nullptr, impl_->model.get()}}};
  XXH64_reset(&hasher.state, 0);
  visit(hasher, rule(toRead(impl_->state)));
  return XXH64_digest(&hasher.state);
}

void World::save(std::vector<std::uint8_t>& bytes) const {
  bytes.clear();
  Writer writer{{{nullptr, impl_->model.get()}}, bytes};
  const std::string& hash = impl_->model->description.hash;
  writer.values(kSnapshotMagic.data(), kSnapshotMagic.size(), {});
  writer.count(hash.size(), 1, {});
  writer.values(hash.data(), hash.size(), {});
  visit(writer, rule(toRead(impl_->state)));
  writer.flush();
  writer.count(XXH64(bytes.data(), bytes.size(), 0), 1, {});
}

void World::restore(const std::vector<std::uint8_t>& all) {
  const std::string_view begin(reinterpret_cast<const char*>(all.data()),
                               std::min<std::size_t>(all.size(), 8));
  if (kSnapshotMagic != begin)
    refuse("begins with '" + files::shown(std::string(begin)) + "'; allowed: " + std::string(kSnapshotMagic) +
           (begin.substr(0, 7) == kSnapshotMagic.substr(0, 7) ? " (it was written by another version of VEST)"
                                                              : ""));
  std::uint64_t sum = 0;
  if (all.size() < 24) refuse("ends after " + std::to_string(all.size()) + " bytes (cut off)");
  const std::vector<std::uint8_t> bytes(all.begin(), all.end() - sizeof sum);
  std::memcpy(&sum, all.data() + bytes.size(), sizeof sum);
  if (sum != XXH64(bytes.data(), bytes.size(), 0))
    refuse("its bytes do not fit its checksum (damaged, or cut off)");
  const WorldModel& model = *impl_->model;
  Reader reader{{{nullptr, &model}}, bytes, kSnapshotMagic.size()};
  std::size_t size = 0;
  reader.count(size, 1, {});
  if (size > 64) refuse("scene_hash of " + std::to_string(size) + " characters (at most 64)");
  std::string hash(size, '\0');
  reader.values(hash.data(), size, {});
  if (hash != model.description.hash)
    refuse("scene_hash '" + files::shown(hash) + "' (the loaded scene's is '" + model.description.hash +
           "')");
  WorldState state = model.start;
  visit(reader, rule(state));
  if (reader.from != bytes.size()) refuse(std::to_string(bytes.size() - reader.from) + " bytes too many");
  Checker checker{{{nullptr, &model}}};
  visit(checker, rule(state));
  for (ObjectState& o : state.objects) repack(o);
  impl_->state = std::move(state);
  impl_->goOn();
}

}  // namespace vest::scene

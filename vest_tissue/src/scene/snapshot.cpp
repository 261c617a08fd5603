#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "snapshot_check.h"
#include "state_bytes.h"
#include "vest_instruments/files/read.h"
#include "world_impl.h"

namespace vest::scene {
namespace {

using snapshot::refuse;

struct WriteArchive {
  std::vector<std::uint8_t>& out;
  void bytes(const void* data, std::size_t size) {
    const auto* const p = static_cast<const std::uint8_t*>(data);
    out.insert(out.end(), p, p + size);
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

struct ReadArchive {
  const std::vector<std::uint8_t>& in;
  std::size_t at = 0;
  void bytes(void* data, std::size_t size) {
    if (size > in.size() - at)
      refuse("ends after " + std::to_string(in.size()) + " bytes (more are needed: cut off?)");
    if (size > 0) std::memcpy(data, in.data() + at, size);
    at += size;
  }
  template <typename T>
  void resize(std::vector<T>& v, std::size_t) {
    std::uint64_t size;
    bytes(&size, sizeof size);
    // What an entry takes in memory is at most 32 times what it takes here.
    if (size > (in.size() - at) / (sizeof(T) / 32 + 1))
      refuse("a list of " + std::to_string(size) + " entries does not fit in the rest of the file");
    v.resize(size);
  }
  template <typename T>
  void numbers(const T* v, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      if (!std::isfinite(v[i])) refuse("a number before byte " + std::to_string(at) + " is not finite");
  }
  void same(std::uint64_t wanted) {
    std::uint64_t size;
    bytes(&size, sizeof size);
    if (size != wanted)
      refuse(std::to_string(size) + " objects or connections (the scene has " + std::to_string(wanted) + ")");
  }
  void within(std::int32_t count, std::int32_t most) {
    if (count < 0 || count > most) refuse(std::to_string(count) + " knots in a clip or sling");
  }
  void room(std::size_t there, std::size_t wanted) {
    if (there < wanted) refuse("heat in an object that conducts none");
  }
  void setCounts(ObjectState& s, std::uint64_t knots, std::uint64_t links) {
    net::Block& b = s.block;
    scene_links = s.links.size();
    if (knots > b.knotCapacity() || knots < b.knots() || links < s.links.size() ||
        links > 2 * s.links.size() + 64) {
      refuse(std::to_string(knots) + " knots and " + std::to_string(links) +
             " links of an object (the scene has " + std::to_string(b.knots()) + " and " +
             std::to_string(s.links.size()) + ")");
    }
    std::uint32_t index;
    while (b.knots() < knots) b.addKnot(index);
    s.links.resize(links);
  }
  /// Same places in the tables as in the world that wrote it: the order of sums is part of the result.
  void repack(ObjectState& s) {
    for (std::size_t i = 0; i < s.links.size(); ++i) {
      const NetLink& l = s.links[i];
      if (l.values.knot0 >= s.block.knots() || l.values.knot1 >= s.block.knots() || !(l.values.rest > 0.0f) ||
          !(l.conductance >= 0.0f && l.conductance < 1e9f) || !(l.values.axial >= 0.0f) ||
          !(l.values.damping >= 0.0f)) {
        refuse("link " + std::to_string(i) + " of an object is damaged");
      }
      net::LinkTable& table = l.by_law ? s.law_links : s.linear_links;
      if (i >= scene_links && (l.place != table.linkCount() || !table.addLink(l.values))) {
        refuse("link " + std::to_string(i) + " of an object has no place");
      }
      if (l.place >= table.linkCount()) refuse("link " + std::to_string(i) + " of an object has no place");
      table.setLink(l.place, l.values.rest, l.values.axial, l.values.damping);
    }
  }
  std::size_t scene_links = 0;
};

}  // namespace

void World::save(std::vector<std::uint8_t>& bytes) const {
  bytes.clear();
  WriteArchive archive{bytes};
  archive.bytes(kSnapshotMagic.data(), kSnapshotMagic.size());
  const std::string& hash = impl_->model->description.hash;
  archive.same(hash.size());
  archive.bytes(hash.data(), hash.size());
  StateWalker<WriteArchive>{archive}.world(const_cast<WorldState&>(impl_->state));
  archive.same(XXH64(bytes.data(), bytes.size(), 0));
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
  ReadArchive archive{bytes, kSnapshotMagic.size()};
  std::uint64_t size;
  archive.bytes(&size, sizeof size);
  if (size > 64) refuse("scene_hash of " + std::to_string(size) + " characters (at most 64)");
  std::string hash(size, '\0');
  archive.bytes(hash.data(), size);
  if (hash != impl_->model->description.hash) {
    refuse("scene_hash '" + files::shown(hash) + "' (the loaded scene's is '" +
           impl_->model->description.hash + "')");
  }
  WorldState state = impl_->model->start;
  StateWalker<ReadArchive>{archive}.world(state);
  if (archive.at != bytes.size()) refuse(std::to_string(bytes.size() - archive.at) + " bytes too many");
  snapshot::check(state, *impl_->model);
  for (ObjectState& o : state.objects) o.law_links.setMaxStrain(o.limit_strain);
  impl_->state = std::move(state);
  impl_->reserve();
  impl_->scratch.forget();
  impl_->deltas.clear();
}

}  // namespace vest::scene

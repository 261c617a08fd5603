#pragma once

#include <vector>

#include "delta_room.h"
#include "vest_tissue/scene/world.h"

namespace vest::scene {

/// The last kDeltaHistory deltas of a World, oldest first. Slots are filled in place and keep their room:
/// what tears inside a step allocates nothing.
class DeltaHistory {
 public:
  DeltaHistory() : slots_(kDeltaHistory + 1) {
    for (TopologyDelta& d : slots_) {
      d.removed_links.reserve(kDeltaLinks), d.added_links.reserve(kDeltaLinks);
      d.doubled_knots.reserve(kDeltaKnots);
      d.removed_triangles.reserve(kDeltaTriangles), d.added_triangles.reserve(kDeltaTriangles);
      d.added_triangle_layer.reserve(kDeltaTriangles), d.rebound_vertices.reserve(kDeltaVertices);
      for (Skin* s : {&d.added_skin, &d.rebound_skin}) {
        s->binding_start.reserve(kDeltaVertices + 1), s->texture_coordinates.reserve(kDeltaVertices);
        s->binding_knots.reserve(kDeltaEntries), s->binding_weights.reserve(kDeltaEntries);
      }
    }
  }
  /// Slot to fill; keep() makes it part of the history. The oldest one goes when there is no room.
  TopologyDelta& next() { return slots_[(first_ + count_) % slots_.size()]; }
  void keep() {
    if (count_ + 1 < slots_.size()) {
      ++count_;
    } else {
      first_ = (first_ + 1) % slots_.size();
    }
  }
  /// Those of a step that was taken back.
  void forgetBeyond(std::uint32_t revision) {
    while (count_ > 0 && slots_[(first_ + count_ - 1) % slots_.size()].revision > revision) --count_;
  }
  void clear() { first_ = count_ = 0; }
  /// As World::deltasSince.
  bool since(std::uint32_t revision, std::uint32_t now, std::vector<TopologyDelta>& out) const {
    out.clear();
    if (revision == now) return true;
    if (revision > now || count_ == 0 || slots_[first_].from_revision > revision) return false;
    for (std::size_t i = 0; i < count_; ++i) {
      const TopologyDelta& d = slots_[(first_ + i) % slots_.size()];
      if (d.from_revision >= revision) out.push_back(d);
    }
    return true;
  }

 private:
  std::vector<TopologyDelta> slots_;
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace vest::scene

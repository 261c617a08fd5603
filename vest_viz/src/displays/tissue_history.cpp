#include "tissue_history.h"

#include <algorithm>

namespace vest::displays {

void TissueHistory::clear() {
  topologies_.clear();
  deltas_.clear();
}

void TissueHistory::add(const vest_msgs::TissueTopology::ConstPtr& topology) {
  if (!topologies_.empty() && (topologies_.back()->scene_hash != topology->scene_hash ||
                               topologies_.back()->scene != topology->scene))
    clear();
  for (auto& known : topologies_)
    if (known->revision == topology->revision) {
      known = topology;
      return;
    }
  topologies_.push_back(topology);
  if (topologies_.size() > kMostTopologies) topologies_.pop_front();
}

void TissueHistory::add(const vest_msgs::TissueTopologyDelta::ConstPtr& delta) {
  for (auto& known : deltas_)
    if (known->from_revision == delta->from_revision) {  // seen before, or another course after a reset
      known = delta;
      return;
    }
  deltas_.push_back(delta);
  if (deltas_.size() > kMostDeltas) deltas_.pop_front();
}

bool TissueHistory::find(std::uint32_t revision, vest_msgs::TissueTopology::ConstPtr* topology,
                         std::vector<vest_msgs::TissueTopologyDelta::ConstPtr>* deltas) const {
  topology->reset();
  deltas->clear();
  for (const auto& known : topologies_)
    if (known->revision <= revision && (!*topology || known->revision > (*topology)->revision))
      *topology = known;
  if (!*topology) return false;
  for (std::uint32_t at = (*topology)->revision; at != revision;) {
    const auto next = std::find_if(deltas_.begin(), deltas_.end(),
                                   [&](const auto& delta) { return delta->from_revision == at; });
    if (next == deltas_.end() || (*next)->revision <= at || (*next)->revision > revision) return false;
    deltas->push_back(*next);
    at = (*next)->revision;
  }
  return true;
}

}  // namespace vest::displays

#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>

namespace vest::displays {

/// The topologies and deltas of a scene that were seen, so that after a jump in a bag the topology of any
/// revision met before is there at once. Others come with the next whole topology (10 s at most).
class TissueHistory {
 public:
  static constexpr std::size_t kMostTopologies = 16, kMostDeltas = 4096;  ///< the oldest go first (assumed)

  /// A topology of another scene starts a new history.
  void add(const vest_msgs::TissueTopology::ConstPtr& topology);
  void add(const vest_msgs::TissueTopologyDelta::ConstPtr& delta);
  /// A whole topology and the deltas that lead from it to a revision, in order. False if they are not known.
  bool find(std::uint32_t revision, vest_msgs::TissueTopology::ConstPtr* topology,
            std::vector<vest_msgs::TissueTopologyDelta::ConstPtr>* deltas) const;
  void clear();

 private:
  std::deque<vest_msgs::TissueTopology::ConstPtr> topologies_;
  std::deque<vest_msgs::TissueTopologyDelta::ConstPtr> deltas_;
};

}  // namespace vest::displays

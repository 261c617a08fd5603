#pragma once

#include <string>
#include <vector>

#include <ros/ros.h>
#include <vest_msgs/SurfaceBleeding.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>

#include "tissue_history.h"
#include "vest_viz/mesh/store.h"

namespace vest::displays {

/// Subscribes to the tissue and keeps a mesh::Store of it. Callbacks only put messages aside; work is done in
/// process(), in the display's update(). Both run in rviz's main thread.
class TissueInput {
 public:
  /// @param prefix topics are PREFIX/topology, PREFIX/topology_delta, PREFIX/state
  /// @param effects blood that surfaces seep comes from EFFECTS/surface; empty: from nowhere
  void subscribe(ros::NodeHandle& handle, const std::string& prefix, const std::string& effects = "effects");
  void unsubscribe();
  /// Forgets what is shown; a jump in time does this. What is known of the topology stays.
  void clear();

  /// For those who read a bag instead of topics.
  void add(const vest_msgs::TissueTopology::ConstPtr& m) {
    topologies_.push_back(m);
    history_.add(m);
  }
  void add(const vest_msgs::TissueTopologyDelta::ConstPtr& m) {
    deltas_.push_back(m);
    history_.add(m);
  }
  void add(const vest_msgs::TissueState::ConstPtr& m) {
    newest_ = m;
    if (!m->fields.empty()) newest_fields_ = m;
  }
  void add(const vest_msgs::SurfaceBleeding::ConstPtr& m) { newest_surface_ = m; }
  /// Kind under which the store keeps the PERFUSION of effects/surface: what the vessels bring. That of
  /// tissue/state is the tissue's own.
  static constexpr std::uint8_t kSupply = 255;

  /// Takes over what arrived. @return true if the store changed
  bool process();

  mesh::Store& store() { return store_; }
  const mesh::Store& store() const { return store_; }
  /// Stamp and step of the state shown; zero before the first.
  const std_msgs::Header& header() const { return header_; }
  /// Simulation step and time (s) of the state shown.
  std::uint64_t step() const { return step_; }
  double time() const { return time_; }
  std::uint64_t states() const { return states_; }
  std::uint64_t dropped() const { return dropped_; }
  /// Empty while all is well; else what was wrong last.
  const std::string& problem() const { return problem_; }

 private:
  /// Brings the topology of a state's revision back, where it was seen before: after a jump in a bag.
  bool recall(const vest_msgs::TissueState& state);
  /// True if the store changed.
  template <class Message>
  bool takeFields(boost::shared_ptr<const Message>* message);

  ros::Subscriber topology_sub_, delta_sub_, state_sub_, surface_sub_;
  std::vector<vest_msgs::TissueTopology::ConstPtr> topologies_;
  std::vector<vest_msgs::TissueTopologyDelta::ConstPtr> deltas_;
  vest_msgs::TissueState::ConstPtr newest_, newest_fields_;  ///< fields come with few of the states
  vest_msgs::SurfaceBleeding::ConstPtr newest_surface_;
  TissueHistory history_;
  std::uint64_t step_ = 0;
  std::uint32_t state_revision_ = 0;  ///< of the state shown; counts from the first state on
  double time_ = 0;
  mesh::Store store_;
  std_msgs::Header header_;
  std::uint64_t states_ = 0, dropped_ = 0;
  std::string problem_;
};

}  // namespace vest::displays

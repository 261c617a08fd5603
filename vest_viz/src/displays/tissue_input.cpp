#include "tissue_input.h"

#include <type_traits>

#include "conversion.h"

namespace vest::displays {

void TissueInput::subscribe(ros::NodeHandle& handle, const std::string& prefix, const std::string& effects) {
  unsubscribe();
  if (prefix.empty()) return;
  topology_sub_ = handle.subscribe<vest_msgs::TissueTopology>(
      prefix + "/topology", 2, [this](const vest_msgs::TissueTopology::ConstPtr& m) { add(m); });
  delta_sub_ = handle.subscribe<vest_msgs::TissueTopologyDelta>(
      prefix + "/topology_delta", 1000,
      [this](const vest_msgs::TissueTopologyDelta::ConstPtr& m) { add(m); });
  state_sub_ = handle.subscribe<vest_msgs::TissueState>(
      prefix + "/state", 1, [this](const vest_msgs::TissueState::ConstPtr& m) { add(m); }, nullptr,
      ros::TransportHints().tcpNoDelay());
  if (effects.empty()) return;
  surface_sub_ = handle.subscribe<vest_msgs::SurfaceBleeding>(
      effects + "/surface", 1, [this](const vest_msgs::SurfaceBleeding::ConstPtr& m) { add(m); });
}

void TissueInput::unsubscribe() {
  topology_sub_.shutdown();
  delta_sub_.shutdown();
  state_sub_.shutdown();
  surface_sub_.shutdown();
}

void TissueInput::clear() {
  topologies_.clear();
  deltas_.clear();
  newest_.reset();
  newest_fields_.reset();
  newest_surface_.reset();
  step_ = 0, time_ = 0;
  store_.setTopology({});
  header_ = {};
  states_ = dropped_ = 0;
  problem_.clear();
}

template <class Message>
bool TissueInput::takeFields(boost::shared_ptr<const Message>* message) {
  if (!*message) return false;
  bool changed = false;
  for (const vest_msgs::TissueField& m : (*message)->fields) {
    mesh::Field field;
    const bool of_vessels =
        std::is_same_v<Message, vest_msgs::SurfaceBleeding> && m.kind == vest_msgs::TissueField::PERFUSION;
    field.kind = of_vessels ? kSupply : m.kind;
    field.minimum = m.minimum, field.maximum = m.maximum, field.data = m.data;
    // Fields of an older revision come again soon: no error.
    const mesh::Outcome outcome = store_.setField((*message)->revision, field);
    if (outcome == mesh::Outcome::Malformed) problem_ = store_.problem();
    changed = changed || outcome == mesh::Outcome::Accepted;
  }
  message->reset();
  return changed;
}

bool TissueInput::recall(const vest_msgs::TissueState& state) {
  const std::uint32_t now = store_.topology().revision;
  // A state that was overtaken by a delta is older by its revision, but not by its step. States come in their
  // order: after one of the newer revision, an older revision is no longer overtaken.
  const bool overtaken = state.revision < now && states_ > 0 && state.step >= step_ && state_revision_ != now;
  if (!store_.empty() && (state.revision == now || overtaken)) return false;
  vest_msgs::TissueTopology::ConstPtr topology;
  std::vector<vest_msgs::TissueTopologyDelta::ConstPtr> deltas;
  if (!history_.find(state.revision, &topology, &deltas)) return false;
  store_.setTopology(toTopology(*topology));
  for (const auto& delta : deltas) store_.applyDelta(toDelta(*delta));
  header_.frame_id = topology->header.frame_id;
  return true;
}

bool TissueInput::process() {
  bool changed = false;
  const auto judge = [&](mesh::Outcome outcome) {
    if (outcome == mesh::Outcome::Accepted) {
      problem_.clear();
      changed = true;
      return true;
    }
    if (outcome == mesh::Outcome::Repeated) return true;
    problem_ = store_.problem();
    changed = changed || outcome == mesh::Outcome::NotFinite;
    return false;
  };
  if (!topologies_.empty()) {
    const auto& newest = topologies_.back();
    if (judge(store_.setTopology(toTopology(*newest)))) problem_.clear();
    changed = true;
    header_.frame_id = newest->header.frame_id;
    topologies_.clear();
  }
  for (const auto& delta : deltas_)
    // Deltas older than a whole topology that just arrived are history, not errors.
    if (store_.empty() || delta->revision > store_.topology().revision)
      judge(store_.applyDelta(toDelta(*delta)));
  deltas_.clear();
  if (newest_) {
    changed = recall(*newest_) || changed;
    if (judge(store_.setState(newest_->revision, newest_->positions.data(), newest_->positions.size()))) {
      header_ = newest_->header;
      step_ = newest_->step;
      state_revision_ = newest_->revision;
      time_ = newest_->time;
      ++states_;
    } else {
      ++dropped_;
    }
    newest_.reset();
  }
  changed = takeFields(&newest_fields_) || changed;
  changed = takeFields(&newest_surface_) || changed;
  if (changed) store_.rebuildSkins();
  return changed;
}

}  // namespace vest::displays

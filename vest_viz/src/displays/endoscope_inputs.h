#pragma once

#include <string>

#include <ros/ros.h>

#include "endoscope_pipeline.h"

namespace vest::displays {

/// What the endoscopic view needs beside tissue and instruments: attachments, sutures, fluid, smoke, lens,
/// and where an exercise wants something. Callbacks put the newest message aside; handTo() passes on what is
/// new.
class EndoscopeInputs {
 public:
  /// Topics are TISSUE/attachments, TISSUE/sutures, EFFECTS/fluid, EFFECTS/smoke, EFFECTS/lens, EFFECTS/gas,
  /// SESSION/targets.
  void subscribe(ros::NodeHandle& handle, const std::string& tissue, const std::string& effects,
                 const std::string& session);
  void unsubscribe();
  void clear() { *this = EndoscopeInputs(); }
  /// Everything is passed on again, to a new pipeline.
  void again();
  bool changed() const;
  void handTo(EndoscopePipeline* view);

  // For those who read a bag instead of topics.
  void add(const vest_msgs::TissueAttachments::ConstPtr& m) { attachments_ = {m, true}; }
  void add(const vest_msgs::SutureStates::ConstPtr& m) { sutures_ = {m, true}; }
  void add(const vest_msgs::FluidState::ConstPtr& m) { fluid_ = {m, true}; }
  void add(const vest_msgs::SmokeState::ConstPtr& m) { smoke_ = {m, true}; }
  void add(const vest_msgs::LensState::ConstPtr& m) { lens_ = {m, true}; }
  void add(const vest_msgs::GasState::ConstPtr& m) { gas_ = {m, true}; }
  void add(const visualization_msgs::MarkerArray::ConstPtr& m) { targets_ = {m, true}; }

 private:
  template <class M>
  struct Newest {
    typename M::ConstPtr message;
    bool fresh = false;
  };
  template <class M>
  ros::Subscriber listen(ros::NodeHandle& handle, const std::string& topic);

  Newest<vest_msgs::TissueAttachments> attachments_;
  Newest<vest_msgs::SutureStates> sutures_;
  Newest<vest_msgs::FluidState> fluid_;
  Newest<vest_msgs::SmokeState> smoke_;
  Newest<vest_msgs::LensState> lens_;
  Newest<vest_msgs::GasState> gas_;
  Newest<visualization_msgs::MarkerArray> targets_;
  ros::Subscriber subscribers_[7];
};

}  // namespace vest::displays

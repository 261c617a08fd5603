#include "endoscope_inputs.h"

namespace vest::displays {

template <class M>
ros::Subscriber EndoscopeInputs::listen(ros::NodeHandle& handle, const std::string& topic) {
  return handle.subscribe<M>(
      topic, 1, [this](const typename M::ConstPtr& m) { add(m); }, nullptr,
      ros::TransportHints().tcpNoDelay());
}

void EndoscopeInputs::subscribe(ros::NodeHandle& handle, const std::string& tissue,
                                const std::string& effects, const std::string& session) {
  unsubscribe();
  if (!session.empty())
    subscribers_[5] = listen<visualization_msgs::MarkerArray>(handle, session + "/targets");
  if (!tissue.empty()) {
    subscribers_[0] = listen<vest_msgs::TissueAttachments>(handle, tissue + "/attachments");
    subscribers_[1] = listen<vest_msgs::SutureStates>(handle, tissue + "/sutures");
  }
  if (effects.empty()) return;
  subscribers_[2] = listen<vest_msgs::FluidState>(handle, effects + "/fluid");
  subscribers_[3] = listen<vest_msgs::SmokeState>(handle, effects + "/smoke");
  subscribers_[4] = listen<vest_msgs::LensState>(handle, effects + "/lens");
  subscribers_[6] = listen<vest_msgs::GasState>(handle, effects + "/gas");
}

void EndoscopeInputs::unsubscribe() {
  for (ros::Subscriber& s : subscribers_) s.shutdown();
}

void EndoscopeInputs::again() {
  attachments_.fresh = attachments_.message != nullptr;
  sutures_.fresh = sutures_.message != nullptr;
  fluid_.fresh = fluid_.message != nullptr;
  smoke_.fresh = smoke_.message != nullptr;
  lens_.fresh = lens_.message != nullptr;
  gas_.fresh = gas_.message != nullptr;
  targets_.fresh = targets_.message != nullptr;
}

bool EndoscopeInputs::changed() const {
  // Fluid and smoke move; attachments and sutures come with every state, whether they changed or not.
  return fluid_.fresh || smoke_.fresh || lens_.fresh || gas_.fresh;
}

void EndoscopeInputs::handTo(EndoscopePipeline* view) {
  if (attachments_.fresh) view->setAttachments(attachments_.message);
  if (sutures_.fresh) view->setSutures(sutures_.message);
  if (fluid_.fresh) view->setFluid(fluid_.message);
  if (smoke_.fresh) view->setSmoke(smoke_.message);
  if (lens_.fresh) view->setLens(lens_.message);
  if (gas_.fresh) view->setGas(gas_.message);
  if (targets_.fresh) view->setTargets(targets_.message);
  attachments_.fresh = sutures_.fresh = fluid_.fresh = smoke_.fresh = lens_.fresh = gas_.fresh =
      targets_.fresh = false;
}

}  // namespace vest::displays

#include <exception>
#include <memory>

#include <nodelet/nodelet.h>
#include <ros/callback_queue.h>
#include <ros/spinner.h>
#include <pluginlib/class_list_macros.hpp>

#include "instruments.h"

namespace vest_instruments {

/// The same node, inside a nodelet manager. Its messages and its timer come a thousand times a second each:
/// one thread of its own serves them, where the manager would hand each over twice.
class InstrumentsNodelet : public nodelet::Nodelet {
 public:
  ~InstrumentsNodelet() override {
    spinner_.stop();
    instruments_.reset();
  }

 private:
  void onInit() override {
    ros::NodeHandle nh(getNodeHandle()), private_nh(getPrivateNodeHandle());
    nh.setCallbackQueue(&queue_);
    private_nh.setCallbackQueue(&queue_);
    try {
      instruments_ = std::make_unique<Instruments>(nh, private_nh);
    } catch (const std::exception& e) {
      NODELET_FATAL("instruments: %s", e.what());
      throw;
    }
    spinner_.start();
  }

  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_{1, &queue_};
  std::unique_ptr<Instruments> instruments_;
};

}  // namespace vest_instruments

PLUGINLIB_EXPORT_CLASS(vest_instruments::InstrumentsNodelet, nodelet::Nodelet)

// The driver as a nodelet.
#include <nodelet/nodelet.h>

#include <pluginlib/class_list_macros.hpp>

#include "../ros/phantom_box_shell.h"

namespace vest::ros_shell {

class PhantomBoxNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      shell_ = std::make_unique<PhantomBoxShell>(getNodeHandle(), getPrivateNodeHandle());
    } catch (const std::exception& e) {
      NODELET_FATAL("phantom_box: %s", e.what());
      throw;  // the manager then refuses to load it
    }
  }
  std::unique_ptr<PhantomBoxShell> shell_;
};

}  // namespace vest::ros_shell

PLUGINLIB_EXPORT_CLASS(vest::ros_shell::PhantomBoxNodelet, nodelet::Nodelet)

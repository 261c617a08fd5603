#include <exception>
#include <memory>

#include <nodelet/nodelet.h>
#include <pluginlib/class_list_macros.hpp>

#include "instruments.h"

namespace vest_instruments {

/// The same node, inside a nodelet manager.
class InstrumentsNodelet : public nodelet::Nodelet {
 private:
  void onInit() override {
    try {
      instruments_ = std::make_unique<Instruments>(getNodeHandle(), getPrivateNodeHandle());
    } catch (const std::exception& e) {
      NODELET_FATAL("instruments: %s", e.what());
      throw;
    }
  }
  std::unique_ptr<Instruments> instruments_;
};

}  // namespace vest_instruments

PLUGINLIB_EXPORT_CLASS(vest_instruments::InstrumentsNodelet, nodelet::Nodelet)

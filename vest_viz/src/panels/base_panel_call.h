#pragma once

#include <ros/service.h>

#include "vest_instruments/ros/service_call.h"

namespace vest::panels {

template <class Service>
void BasePanel::call(const std::string& name, Service service,
                     std::function<void(const Service&, const std::string&)> done) {
  collect();
  auto one = std::make_unique<Call>();
  one->finished = std::make_shared<bool>(false);
  const std::string full = nh().resolveName(name);
  one->thread = std::thread([this, full, service, done, finished = one->finished]() mutable {
    std::string problem;
    if (!ros::service::exists(full, false)) {
      problem = full + ": nobody offers this service; is the trainer running?";
    } else if (!ros_shell::callService(full, service)) {
      problem = full + ": the call failed";
    }
    inView([service, done, problem, finished] {
      *finished = true;
      done(service, problem);
    });
  });
  calls_.push_back(std::move(one));
}

}  // namespace vest::panels

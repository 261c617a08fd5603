#pragma once

#include <string>

#include <ros/node_handle.h>
#include <ros/service_client.h>

namespace vest::ros_shell {

/// Calls `name` (resolved) once and waits for the answer; false if nobody answers.
///
/// ros::service::call() loses answers: the server hangs up behind each, and roscpp closes a connection whose
/// end it sees while it reads (measured: 17 of 8,000 calls beside a load of 4; none of 8,000 this way). A
/// persistent connection is ended by the client.
template <class Service>
bool callService(const std::string& name, Service& service) {
  return ros::NodeHandle().serviceClient<Service>(name, true).call(service);
}

}  // namespace vest::ros_shell

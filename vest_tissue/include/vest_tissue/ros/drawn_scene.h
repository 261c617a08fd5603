#pragma once

#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>

#include "vest_tissue/scene/description.h"

namespace vest::ros_shell {

/// A scene as a session would tell of it before its first step, without a World, which costs a second: for
/// pictures. Revision 1. The stamp is the caller's.
vest_msgs::TissueTopology topologyOf(const scene::Description& scene);
/// Where everything is then. Revision and stamp are the topology's.
vest_msgs::TissueState stateOf(const scene::Description& scene, const vest_msgs::TissueTopology& topology);

/// Rings, their stations and the vessel of a tubular organ.
void tubeToMsg(const scene::TubeMap& tube, vest_msgs::TissueObject& msg);

}  // namespace vest::ros_shell

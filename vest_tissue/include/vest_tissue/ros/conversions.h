#pragma once

#include <string>

#include <visualization_msgs/MarkerArray.h>

#include <vest_msgs/ContactModels.h>
#include <vest_msgs/ImageVolume.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/SutureStates.h>
#include <vest_msgs/TissueAttachments.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>

#include "vest_tissue/scene/runner.h"
#include "vest_tissue/volume/brick.h"

/// The one place where values of the core become messages and back. Units and frames are those of the
/// messages; headers are the caller's, but for frame_id.
namespace vest::ros_shell {

/// Everything a step consumed. Bit-exact both ways: fromMsg(toMsg(x)) == x.
void toMsg(const scene::StepFrame& frame, const scene::Description& description, vest_msgs::StepInput& msg);
/// @throws std::invalid_argument naming the field, where the message names an object that the scene does not
/// have
void fromMsg(const vest_msgs::StepInput& msg, const scene::Description& description, scene::StepInput& input);

/// Newest sample of the instruments. An instrument that fell silent stays where it was; one whose pose was
/// never known, or is not finite, is not there. @return false where a value was refused
bool fromMsg(const vest_msgs::InstrumentStates& msg, scene::ToolSample& sample);

void toMsg(const scene::ContactFrame& frame, double age, vest_msgs::ContactModels& msg);
void toMsg(const scene::Event& event, const scene::Description& description, vest_msgs::TissueEvent& msg);
void toMsg(const scene::World& world, vest_msgs::TissueTopology& msg);
void toMsg(const scene::TopologyDelta& delta, vest_msgs::TissueTopologyDelta& msg);
void toMsg(const scene::StateFrame& frame, vest_msgs::TissueState& msg);
void toMsg(const scene::StateFrame& frame, const scene::Description& description,
           vest_msgs::TissueAttachments& msg);
void toMsg(const scene::StateFrame& frame, const scene::Description& description,
           vest_msgs::SutureStates& msg);
/// All but name, modality and hash.
void toMsg(const volume::Brick& brick, vest_msgs::ImageVolume& msg);
/// Skins as triangle lists for stock clients.
void toMarkers(const vest_msgs::TissueTopology& topology, const scene::StateFrame& frame,
               visualization_msgs::MarkerArray& msg);

}  // namespace vest::ros_shell

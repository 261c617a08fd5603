#pragma once

#include "vest_tissue/scene/world.h"
#include "vest_tissue/shared/contact_memory.h"

namespace vest::scene {
/// What a tool is in a patient's image: an injection needle is a needle, all else but the endoscope a probe.
voxel::Kind feelsAs(tools::ToolKind tool) noexcept;
/// m beyond the tip's frame to the point that feels.
double reachOf(tools::ToolKind tool) noexcept;
}  // namespace vest::scene

namespace vest::shared {

/// A step's contact model and the input that it came from, as they go to the shared memory. Real-time safe.
void fillRecord(const scene::ContactModel& model, const scene::ToolInput& input,
                ContactRecord& record) noexcept;

}  // namespace vest::shared

#pragma once

#include "vest_tissue/scene/world.h"
#include "vest_tissue/shared/contact_memory.h"

namespace vest::shared {

/// A step's contact model and the input that it came from, as they go to the shared memory. Real-time safe.
void fillRecord(const scene::ContactModel& model, const scene::ToolInput& input,
                ContactRecord& record) noexcept;

}  // namespace vest::shared

#pragma once

#include <string>

#include "vest_tissue/scene/description.h"
#include "vest_tissue/scene/step_input.h"

namespace vest::scene {

/// A request as vest_msgs/StepInput.requests carries it: `remove_link OBJECT LINK`,
/// `split_knot OBJECT KNOT NX NY NZ` or `remove_clip ID`. Exact both ways: numbers have 17 digits.
std::string requestText(const TopologyRequest& request, const Description& description);
/// @throws std::invalid_argument: the text, and what is allowed
TopologyRequest parseRequest(const std::string& text, const Description& description);

}  // namespace vest::scene

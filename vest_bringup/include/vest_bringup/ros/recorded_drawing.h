#pragma once

#include <optional>
#include <string>

#include "vest_tissue/modelling/session.h"

namespace vest::session {

/// A recorded drawing, done again: the topic model/edits of a bag, edit by edit, the hash behind each
/// compared.
/// @return the drawing that began last; nothing where the bag has no such topic
/// @throws std::invalid_argument, std::runtime_error: bag, edit, and what is wrong with it
std::optional<modelling::Session> replayDrawing(const std::string& bag);

}  // namespace vest::session

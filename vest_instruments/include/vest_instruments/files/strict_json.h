#pragma once

#include <cstddef>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "vest_instruments/files/read.h"

namespace vest::files {

/// The value of a JSON text (RFC 8259), whose objects have each key once.
/// @param deepest levels of lists and objects within each other
/// @throws Refused with the line: deeper, more than a million values, a key twice in one object (field
/// "key"), no JSON (field "JSON"), numbers that no double holds
nlohmann::json parseJson(const std::string& text, std::size_t deepest = 32);

}  // namespace vest::files

#pragma once

#include <string>

namespace vest::files {

/// Bytes that are no UTF-8 (too long, surrogates and beyond U+10FFFF included) become '?'.
std::string asUtf8(std::string text);

}  // namespace vest::files

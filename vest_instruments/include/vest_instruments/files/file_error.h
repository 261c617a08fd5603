#pragma once

#include <stdexcept>

namespace vest::files {

/// A file that cannot be used; what() names file, field, value and what is allowed.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace vest::files

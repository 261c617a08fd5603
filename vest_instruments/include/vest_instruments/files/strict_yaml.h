/// One YAML document, looked at before a tree is built of it.
#pragma once

#include <cstddef>
#include <string>

#include <yaml-cpp/yaml.h>

#include "vest_instruments/files/read.h"

namespace vest::files {

struct YamlLimits {
  int depth = 32;               ///< of lists and maps within each other
  std::size_t values = 100000;  ///< words, lists and maps together; a tree takes some hundred bytes for each
};

/// The tree of a text. Anchors, aliases, tags, a second document, and what is beyond the limits are refused
/// while only its events are read. @throws Refused with line; empty texts are a null node
YAML::Node parseYaml(const std::string& text, const YamlLimits& limits = {});

}  // namespace vest::files

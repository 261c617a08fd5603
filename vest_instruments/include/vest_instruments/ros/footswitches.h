#pragma once

#include <algorithm>
#include <cctype>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <ros/node_handle.h>

#include "vest_instruments/control/pedals.h"

namespace vest_instruments {

/// What the footswitches of the session's box mean. The parameters `footswitch_preset`,
/// `footswitch_functions` and `footswitch_names` lie in the session's namespace, not in a node's: the driver
/// and the instruments read the same ones.
/// @param nh of the session's namespace
/// @throws std::runtime_error that names parameter, value and what is allowed
inline vest::control::Footswitches readFootswitches(const ros::NodeHandle& nh) {
  using vest::control::Footswitches;
  const auto refuse = [&](const std::string& name, const std::string& value, const std::string& allowed) {
    throw std::runtime_error("parameter " + nh.resolveName(name) + ": " + value + "; allowed: " + allowed);
  };
  constexpr std::size_t kSix = std::tuple_size<decltype(Footswitches::names)>::value;
  const auto list = [&](const std::string& name, const std::string& allowed) {
    std::vector<std::string> words;
    if (!nh.getParam(name, words) || words.size() != kSix) refuse(name, "not six words", allowed);
    return words;
  };
  std::string preset = "trainer";
  if (nh.hasParam("footswitch_preset") && !nh.getParam("footswitch_preset", preset))
    refuse("footswitch_preset", "no word", "trainer, dvrk, custom, inputs");
  const bool custom = preset == "custom", by_map = preset == "inputs";
  for (const char* name : {"footswitch_functions", "footswitch_names"}) {
    if (nh.hasParam(name) && !custom && !(by_map && std::string(name) == "footswitch_names"))
      refuse(name, "given together with footswitch_preset '" + preset + "'", "preset custom");
  }
  if (const auto known = vest::control::footswitchPreset(preset)) return *known;
  if (!custom && !by_map)
    refuse("footswitch_preset", "'" + preset + "'",
           "trainer, dvrk, custom (with footswitch_functions), inputs (an input map says what pedals do)");
  Footswitches own;
  for (std::size_t i = 0; i < kSix; ++i) own.names[i] = "pedal_" + std::to_string(i);
  if (custom) {
    const std::string allowed = "six of " + vest::control::pedalFunctionNames();
    const std::vector<std::string> words = list("footswitch_functions", allowed);
    for (std::size_t i = 0; i < kSix; ++i) {
      const auto function = vest::control::pedalFunctionFromName(words[i]);
      if (!function) refuse("footswitch_functions", "'" + words[i] + "'", allowed);
      own.functions[i] = *function;
    }
  }
  if (!nh.hasParam("footswitch_names")) return own;
  const std::string allowed = "six different names of letters, digits and _, a letter first";
  const std::vector<std::string> names = list("footswitch_names", allowed);
  std::set<std::string> seen;
  for (std::size_t i = 0; i < kSix; ++i) {
    const std::string& name = names[i];
    const bool word =
        !name.empty() && std::isalpha(static_cast<unsigned char>(name[0])) &&
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (!word || !seen.insert(name).second) refuse("footswitch_names", "'" + name + "'", allowed);
    own.names[i] = name;
  }
  return own;
}

}  // namespace vest_instruments

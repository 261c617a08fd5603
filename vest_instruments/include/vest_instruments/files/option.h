/// Numbers on a command line, for programs that parse it with CLI11.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include "vest_instruments/files/read.h"

namespace vest::files {

/// Takes a finite number from `least` to `most`. CLI::Range and CLI::NonNegativeNumber let a NaN pass, and
/// every comparison with it is false behind them.
inline CLI::Validator number(double least, double most) {
  const std::string range = CLI::Range(least, most).get_description();
  return CLI::Validator(
      [=](std::string& text) {
        double value = 0;
        const bool good = parseNumber(text, value) && value >= least && value <= most;
        return good ? std::string() : shown(text) + " is no " + range;
      },
      range);
}

}  // namespace vest::files

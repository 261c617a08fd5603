#pragma once

#include <map>
#include <string>
#include <utility>

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"

/// What the files of materials and of sutures have in common: numbers with their sources.
namespace vest::material {

/// Keys of a kind of entry, and the numbers that are allowed.
using Ranges = std::map<std::string, std::pair<double, double>>;
using Words = std::map<std::string, std::string>;

/// Text of at least so many bytes.
std::string words(const scene::yaml::Value& value, std::size_t least);
/// `units`: one per key of the ranges.
Words readUnits(const scene::yaml::Value& value, const Ranges& ranges);
/// `sources`: citations by their keys.
Words readSources(const scene::yaml::Value& value);
/// {value, source, place, quoted, strain} or {value, assumed: true, why}.
Quantity readQuantity(const scene::yaml::Value& value, const std::pair<double, double>& range,
                      const std::string& unit, const Words& sources);

}  // namespace vest::material

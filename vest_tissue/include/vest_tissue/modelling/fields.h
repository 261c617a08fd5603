#pragma once

#include <string>
#include <vector>

#include "vest_tissue/modelling/document.h"

/// What a source may say of an object: the reader refuses by these ranges, and a panel shows them.
namespace vest::modelling {

/// A value below an object. Lengths are m in the world's frame, as everywhere in a source.
struct Field {
  enum class Kind : unsigned char { Number, Positive, Whole, Vector, Word } kind = Kind::Word;
  const char* path;  ///< keys behind a slash each; `*` is any place of a list: tube/sections/*/radii/*
  const char* unit;  ///< empty: none
  double least = 0, most = 0;  ///< of Number and Whole; both belong to the range
  const char* what;            ///< in a few words
};

/// All that is known, in the order of docs/scene_format.md.
const std::vector<Field>& fields();
/// @param path below the object, with places as numbers or as `*`; null where nothing is known of it
const Field* fieldOf(const std::string& path);
/// The range as a person reads it: "0 … 2", "> 0", "whole, 3 … 1000"; empty for words.
std::string allowedText(const Field& field);

/// A value of an object, as it stands in the text.
struct Entry {
  std::string path;   ///< below the object
  std::string value;  ///< YAML in one line; empty: the source does not say, its default goes
  const Field* field = nullptr;
};
/// What a person edits of an object, one value each: scalars, and lists of numbers or words. Behind them the
/// optional numbers that the source does not have. @throws std::invalid_argument where there is no such
/// object
std::vector<Entry> entriesOf(const Document& document, const std::string& object);

/// What a list of objects shows.
struct ObjectLine {
  std::string name, kind, organ, material;  ///< kind: tube, sheet, revolve, tree, or "mirror of NAME"
};
std::vector<ObjectLine> objectsOf(const Document& document);

}  // namespace vest::modelling

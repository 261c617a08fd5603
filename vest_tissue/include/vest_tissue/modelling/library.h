#pragma once

#include <string>
#include <vector>

#include "vest_tissue/modelling/session.h"

/// What VEST ships to draw with: scenes, parts, materials, tables of colours, textures (docs/modelling.md).
namespace vest::modelling {

struct LibraryEntry {
  std::string kind;     ///< part, scene, material, table or texture
  std::string name;     ///< once among those of its kind
  std::string file;     ///< of this machine; empty: a texture, which is made by code
  std::string licence;  ///< SPDX
  std::string source;   ///< where it is from
  std::string about;    ///< one line
  std::string picture;  ///< library/pictures/KIND_NAME.jpg; empty: there is none. Parts and scenes have one
};

/// library/index.yaml of this package, with the materials of data/materials.yaml. By kind, each in the
/// index's order. An entry without licence, source or file is refused. @throws std::invalid_argument
std::vector<LibraryEntry> readLibrary();
/// The same of an index elsewhere; its files lie beside its folder.
std::vector<LibraryEntry> readLibrary(const std::string& index);
/// @param kind empty: any @throws std::invalid_argument where there is none, or more than one
const LibraryEntry& find(const std::vector<LibraryEntry>& entries, const std::string& name,
                         const std::string& kind = {});

/// Reads all that the entries name: scenes, tables, and each part as the only one of a source, baked.
/// @return a line for each entry with a fault: kind, name, what is wrong. Empty: all is good
std::vector<std::string> faultsOf(const std::vector<LibraryEntry>& entries);

/// Edits that put a part's objects into a source, behind its own. Names that are taken get a number behind
/// them, and what refers to them within the part goes with them. Comments of the part stay behind.
/// @param as name of its first object, before those of the others; empty: as in the part
/// @param by m: it is drawn so far from where the part says
/// @throws std::invalid_argument
std::vector<Script::Line> additions(const Document& source, const std::string& part_file,
                                    const std::string& as = {}, const Vector3& by = Vector3::Zero());

}  // namespace vest::modelling

#pragma once

#include <string>
#include <vector>

#include "vest_tissue/modelling/library.h"

namespace vest::tools {

/// `vest_model list`: a line an entry: kind, name, licence, what it is, where it is from.
void printLibrary(const std::vector<modelling::LibraryEntry>& entries, const std::string& kind);

/// `vest_model show`: all that is said of an entry; of parts and scenes that have a source, the objects too.
void printEntry(const modelling::LibraryEntry& entry);

/// `vest_model check` without a scene: a line for each fault, and how many entries there are. @return no
/// fault
bool checkLibrary(const std::vector<modelling::LibraryEntry>& entries);

/// `vest_model add`: a part's objects into a source. @return the scene file that was written
std::string addPart(const std::string& source, const modelling::LibraryEntry& entry, const std::string& as,
                    const std::vector<double>& by, const std::string& directory,
                    const modelling::Materials& materials);

}  // namespace vest::tools

#pragma once

#include <map>
#include <string>

#include "vest_tissue/modelling/session.h"

namespace vest::tools {

/// `vest_model edit`. @return the scene file that was written; empty: nothing was to be written
std::string editSource(const std::string& source, const std::string& script, const std::string& directory,
                       const modelling::Materials& materials);

/// `vest_model propose`: edits that would tie an object to what lies near it, as an edits file.
void printProposals(const std::string& source, const std::string& object, double within,
                    const modelling::Materials& materials);

}  // namespace vest::tools

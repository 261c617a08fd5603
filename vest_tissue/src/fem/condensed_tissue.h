#pragma once

#include <functional>

#include "vest_tissue/fem/tissue.h"

namespace vest::fem {

/// makeTissue() and prepareTissue() of condensed objects.
std::shared_ptr<TissueModel> makeCondensed(const Description& description, const std::string& cache);
void prepareCondensed(TissueModel& tissue, double h, const std::function<void(double)>& progress);

}  // namespace vest::fem

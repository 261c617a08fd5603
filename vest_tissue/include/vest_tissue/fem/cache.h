#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/fem/description.h"

namespace vest::fem {

/// XXH64 over everything that the condensed inverse depends on: rest shape, tetrahedra, held nodes, E and nu,
/// outer nodes, and the version of the computation.
/// @param step s: of the matrix of a step of backward Euler, which depends on masses and damping too; 0: the
/// stiffness alone
std::uint64_t contentHash(const Description& description, const std::vector<Index>& outer_nodes,
                          double step = 0.0);

/// File of a matrix in a cache folder (vest_tissue/cache/block.h).
std::string cachePath(const std::string& directory, std::uint64_t content_hash);

/// False where there is no such file, or it is cut short, damaged or of other content: then it is to be
/// rebuilt.
bool loadMatrix(const std::string& directory, std::uint64_t content_hash, Eigen::Index rows,
                Eigen::MatrixXd& matrix);

/// Written beside and renamed, so that a reader never sees half a file; the folder is made. False: could not
/// be written (a full disk, no permission), which costs time at the next start and nothing else.
bool saveMatrix(const std::string& directory, std::uint64_t content_hash, const Eigen::MatrixXd& matrix);

}  // namespace vest::fem

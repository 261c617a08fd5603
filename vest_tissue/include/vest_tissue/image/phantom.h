/// Patients made of exact shapes, as images and as DICOM files: what a test or a trial needs without a
/// patient.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/image/volume.h"
#include "vest_tissue/volume/image.h"
#include "vest_tissue/volume/phantom.h"

namespace vest::image {

using volume::makePhantom;
using volume::Phantom;
using volume::Shape;

struct PhantomImage {
  std::array<std::uint32_t, 3> size{128, 128, 64};  ///< voxels over the block
  double noise = 0;                                 ///< HU, standard deviation, nearly Gaussian
  std::uint64_t seed = 1;
};

/// CT of a phantom: each voxel has the value at its centre, and noise. Same options, same bits.
Volume picture(const Phantom& phantom, const PhantomImage& options);
/// Which shape each voxel is of; axes as those of picture(), places in DICOM's axes.
volume::LabelledImage labels(const Phantom& phantom, const PhantomImage& options);

/// Names of what can be wrong or unusual with files, for writeDicom(), each with one line about it.
const std::vector<std::pair<std::string, std::string>>& faults();

/// A series of DICOM files, I0001 … in a folder that is there. `fault` is "none" or one of faults().
/// @throws std::invalid_argument: not known, cannot be written
void writeDicom(const Volume& volume, const std::string& folder, const std::string& fault);

}  // namespace vest::image

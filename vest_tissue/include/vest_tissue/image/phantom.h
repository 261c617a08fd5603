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

namespace vest::image {

/// Part of a phantom, in metres along the patient's axes (left, posterior, superior).
struct Shape {
  enum Kind { Ellipsoid, Box, Cylinder };  ///< a cylinder stands along the third axis
  Kind kind = Ellipsoid;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Ones();  ///< half axes
  std::int16_t value = 0;                          ///< HU
  std::uint16_t label = 0;
  bool holds(const Eigen::Vector3d& place) const;
  double volume() const;  ///< m³
};

/// Where shapes overlap, the later one counts; around them is air of -1000 HU, label 0.
struct Phantom {
  std::string name;
  Eigen::Vector3d low, high;  ///< m: block that the images show
  std::vector<Shape> shapes;
  std::vector<std::string> labels;                      ///< name of each label from 1
  const Shape* at(const Eigen::Vector3d& place) const;  ///< null: air
};

/// head, lumbar or abdomen: sizes of an adult, simplified (assumed). @throws std::invalid_argument: another
/// name
Phantom makePhantom(const std::string& name);

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

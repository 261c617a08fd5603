/// Patients made of exact shapes: what a test or a scene needs without a patient.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/volume/brick.h"

namespace vest::volume {

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

/// Where a block of a phantom lies in world, and how fine it is.
struct PhantomBlock {
  Eigen::Vector3d low, high;                           ///< m, patient's axes
  double spacing = 0.001;                              ///< m, edge of a voxel
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  ///< patient's axes → world
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();     ///< m, world: where the patient's origin lies
  double noise = 0;                                    ///< HU, standard deviation, nearly Gaussian
  std::uint64_t seed = 1;
  Eigen::Vector3d toPatient(const Eigen::Vector3d& world) const { return turn.transpose() * (world - shift); }
};

/// CT of a block: each voxel has the value at its centre, and noise. Same block, same bits.
Brick picture(const Phantom& phantom, const PhantomBlock& block);

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) summed to a nearly Gaussian number of a voxel, whatever the
/// order: mean 0, variance 1, within ±3.5.
double nearlyGaussian(std::uint64_t seed, std::uint64_t index);

}  // namespace vest::volume

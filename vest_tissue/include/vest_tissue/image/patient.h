/// From a patient's images to a scene: a recipe says which values are which tissue.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/image/volume.h"
#include "vest_tissue/volume/lattice.h"

namespace vest::image {

/// What becomes one label. Voxels whose value (or label of a ready map) lies in `low` … `high`, then, in this
/// order: a median (majority of the cube around each), a closing (voxels that a cube of this size cannot
/// leave without meeting the label), what is connected to a place, the largest connected parts. Connected:
/// across faces.
struct Segment {
  std::string name, tissue;               ///< tissue: of the database of materials
  double low = 0, high = 0;               ///< HU, or the unit of the images
  std::uint32_t median = 0, closing = 0;  ///< voxels to each side; 0: none
  bool grows = false;
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< m, patient's axes
  std::uint32_t largest = 0;                       ///< how many; 0: all
};

struct Patient {
  std::string file;  ///< path of the recipe
  std::string name;
  std::string images;     ///< path; may be empty where there is a ready label map
  std::string label_map;  ///< path; empty: labels come from the values of the images
  ReadOptions reading;
  bool cropped = false;
  Eigen::Vector3d low, high;      ///< m, patient's axes: voxels outside are no label
  std::vector<Segment> segments;  ///< labels 1 …; where they overlap, the later one counts
  double cell = 0;                ///< m
  std::vector<std::string> held;  ///< segments whose nodes do not move; none: the lowest tenth of the mesh
  /// Of the scene's elements: backward_euler (corotational), elastostatic or condensed (both of small
  /// strain).
  std::string integrator = "backward_euler";
  Eigen::Vector3d place{0, 0.05, 0.03};  ///< m, world: where the middle of the mesh's underside comes to lie
};

/// Reads a recipe, patient.yaml (docs/images.md), strictly. @throws std::invalid_argument: file, line, field
Patient readPatient(const std::string& path);

/// A recipe to begin with: soft tissue and bone. @param images path, as written into it @param fitting its
/// cell is the largest of some at which both keep half of their volume, where a scene has so many nodes; else
/// it is a twentieth of the volume, and nothing is meshed
std::string firstPatient(const std::string& name, const std::string& images, const Volume& volume,
                         bool fitting = true);

/// A recipe to begin with: each label of a ready map. @throws std::invalid_argument: is no label map
std::string firstOfLabels(const std::string& name, const std::string& map, const Volume& volume,
                          bool fitting = true);

/// How many voxels each label of a ready map has, but 0. @throws std::invalid_argument: a value that is no
/// whole number of 0 … 65535, more than 100 labels
std::map<std::uint16_t, std::size_t> countLabels(const Volume& volume);

/// The volume that segment() takes: the images, or the ready label map, which lies where the images are.
/// @throws std::invalid_argument: recipe, field, and as read(); another grid than that of the images
Volume readSource(const Patient& patient);

/// @throws std::invalid_argument: a sheared volume; a segment without a voxel, by name
volume::LabelledImage segment(const Volume& volume, const Patient& patient);

/// Tetrahedra of the labels, the patient supine: world = (-L, -S, -P) of the patient's axes, moved to
/// `place`.
volume::Lattice mesh(const volume::LabelledImage& labels, const Patient& patient);

/// Of a label, m³.
struct LabelVolume {
  double voxels, elements;
};
std::vector<LabelVolume> volumesOf(const volume::LabelledImage& labels, const volume::Lattice& lattice,
                                   std::size_t segments);

/// Which labels have lost more than half of their voxels' volume (tuned), and what helps; empty where none
/// has.
std::string lossSentence(const std::vector<LabelVolume>& volumes, const Patient& patient);

/// Writes NAME.yaml, NAME.vtk and NAME_held.csv, a scene of one object of elements. @param directory is there
/// @param check is given the scene before the three files take their places: where it throws, none of them
/// does
/// @return path of the scene @throws std::invalid_argument: more nodes than a World holds, cannot be written
std::string writePatientScene(const volume::Lattice& lattice, const Patient& patient,
                              const std::string& directory,
                              const std::function<void(const std::string& scene)>& check = {});

}  // namespace vest::image

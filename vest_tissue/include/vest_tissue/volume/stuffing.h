#pragma once

#include <utility>

#include "vest_tissue/volume/lattice.h"

namespace vest::volume {

/// Conforming tetrahedra that fill the labels of an image, with bounded dihedral angles: isosurface stuffing
/// on a body-centred cubic lattice (Labelle and Shewchuk 2007, doi 10.1145/1276377.1276448). The surface is
/// where half of what a smooth kernel of 0.58 voxels standard deviation sees has a label. Each tetrahedron
/// takes the label that most of it sees; nodes between two labels then move onto their interface as far as no
/// dihedral angle leaves 12 … 165 degrees. What is thinner than a cell is lost. The same image gives the same
/// bits.
/// @param cell m: edge of the lattice's cubes
/// @throws std::invalid_argument: nothing labelled, too many cubes, a cell that is no positive number
Lattice stuffLabels(const LabelledImage& image, double cell);

/// Least and greatest dihedral angle of all tetrahedra, degrees.
std::pair<double, double> dihedralAngles(const Lattice& lattice);

double volumeOf(const Lattice& lattice, std::uint16_t label);  ///< m³

}  // namespace vest::volume

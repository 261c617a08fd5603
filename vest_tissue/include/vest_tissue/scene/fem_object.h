#pragma once

#include <string>

#include "vest_tissue/scene/description.h"

namespace vest::scene {

/// Knots of finite elements: their nodes; of condensed ones those that can be touched.
std::size_t knotsOf(const fem::Description& description);

/// Gives an object with tetrahedra (object.fem) what it shares with nets: knots (its nodes, in their order),
/// lumped masses, held knots, contact triangles (boundary faces, counter-clockwise from outside) and, where
/// it has none yet, a skin: one vertex per boundary node. Texture coordinates, m: u = x + z/2, v = y + z/2 of
/// the rest shape, which has no seam. Of a condensed object the nodes of its boundary and of its skin come
/// first and are its knots, in the order in which they were. Does not check the tetrahedra.
void completeFem(Object& object);

/// One sentence that names the condensed objects and says what they cannot do; empty: there are none.
std::string condensedSentence(const Description& description);

/// Moves an object's knots to where gravity (m/s²) and its loads bring it. @throws std::invalid_argument
/// naming the object: nothing holds it, or no equilibrium was found
void settleFem(Object& object, const Eigen::Vector3d& gravity);

/// Boundary faces of tetrahedra, counter-clockwise from outside, in the order of the tetrahedra.
std::vector<std::array<Index, 3>> boundaryFaces(const std::vector<std::array<Index, 4>>& tetrahedra);

}  // namespace vest::scene

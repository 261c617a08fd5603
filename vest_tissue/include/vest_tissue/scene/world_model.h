#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "vest_tissue/base/distance_grid.h"
#include "vest_tissue/fem/tissue.h"
#include "vest_tissue/net/tube_map.h"
#include "vest_tissue/scene/thread_model.h"
#include "vest_tissue/scene/world_state.h"
#include "vest_tissue/solver/step_bound.h"

namespace vest::scene {

class Body;

/// An edge of the contact surface: of a triangle from this corner to the next, and the triangle beyond it.
struct SurfaceEdge {
  std::uint32_t triangle = 0, beyond = 0;
  std::uint32_t corner = 0;
};

/// How an object is stepped.
struct StepBounds {
  solver::Rates rates;          ///< of the links at the start, contact reserve included
  double calibration = 1.0;     ///< power iteration over the rigorous bound, <= 1 (docs/decisions/0011-…)
  double bound_at_start = 0.0;  ///< rigorous bound of the links at the start, 1/s²
  double slow_omega_squared = 0.0, slow_decay = 0.0;
  double contact_omega_squared = 0.0;  ///< stiffness over mass that contacts may add, 1/s²
  int sub_steps = 1;                   ///< at dt of the description
  double exchanges_needed = 1.0;       ///< times a step that held forces have to be renewed; <= batches
  double volume_needed = 1.0;          ///< and the enclosed volume's gradient; <= volume_batches
  bool implicit = false;  ///< stepped by solver::ImplicitNet: more than the explicit sub-steps can hold
};

/// What of one object never changes once built.
struct ObjectConstants : StepBounds {
  std::uint64_t identity = 0;                   ///< of what the scene says of it (src/scene/identity.h)
  StepBounds alone;                             ///< without what other objects ask for
  bool deforms = true;                          ///< false: rigid
  const Body* body = nullptr;                   ///< what it does as tissue (src/scene/body.h)
  std::shared_ptr<const fem::TissueModel> fem;  ///< finite elements, fem or volume; else null
  material::Law law;
  double contact_series = 1.0;  ///< of a contact spring's stiffness: in series with the tissue behind it
  double youngs_modulus = 0.0;  ///< Pa, at the start
  int batches = 1;              ///< at dt of the description
  int volume_batches = 1;  ///< times a step that the enclosed volume's gradient is renewed; divides batches
  double greatest_edge = 0.0;          ///< m, of the contact triangles at the start
  bool closed = false;                 ///< contact triangles form a closed surface
  std::vector<std::uint8_t> together;  ///< per object (itself, too): no contact with it, by design
  /// Per object, per knot of the scene: near or in that object at the start, no contact with it. Empty: all
  /// may touch it.
  std::vector<std::vector<std::uint8_t>> designed;
  std::vector<SurfaceEdge> edges;  ///< of the contact triangles, each once
  /// With full contact, per knot of the scene, ascending: knots of the surface that are beside it at rest.
  /// Neither touches the triangles of the other. None: it is not on the surface.
  std::vector<std::uint32_t> beside_first, beside_knots;
  bool onSurface(std::uint32_t knot) const { return beside_first[knot] < beside_first[knot + 1]; }
  bool beside(std::uint32_t a, std::uint32_t b) const {
    const auto first = beside_knots.begin();
    return std::binary_search(first + beside_first[a], first + beside_first[a + 1], b);
  }
  bool floats = false;      ///< none of its knots hangs on anything fixed: tethers alone carry it
  bool polynomial = false;  ///< the law has a2, a3 or a4
  net::TubeMap tube;
  struct RingLink {
    std::uint32_t link = 0;  ///< of the block
    float place = 0;         ///< along the tube, 0 … DilatationInput::kPlaces − 1
  };
  std::vector<RingLink> ring_links;    ///< within a ring: dilatation acts on them
  contact::DistanceGrid grid;          ///< rigid only
  double lowest = 0.0, highest = 0.0;  ///< m, of its knots; rigid only
  interaction::HeatModel heat;         ///< nets only
  interaction::CutConstants cut;
  motility::MotilityModel motility;  ///< where the object moves by itself
  std::vector<std::uint32_t> tied;   ///< ends of connections on it, in their order: 2·connection + end
};

/// What of a connection never changes once built.
struct ConnectionConstants {
  double inverse_mass = 0.0;  ///< 1/kg, of both ends
  double strand = 0.0;        ///< m: part of the offset that is a strand of this length, turning freely
  double stiffness = 0.0, damping = 0.0, break_force = 0.0;  ///< N/m, N·s/m, N: scene::Connection
};

/// Immutable once built.
struct WorldModel {
  Description description;
  std::vector<ObjectConstants> objects;
  std::vector<std::uint64_t> sutures;  ///< identity of each
  std::vector<std::size_t> bodies;     ///< the objects that deform, in their order
  int batches = 1;                     ///< greatest of all; a multiple of each
  WorldState start;                    ///< what reset() returns to
  /// Whether edges of two objects, or of one, meet, and what touches at the start collides elsewhere.
  bool fullContact(std::size_t a, std::size_t b) const {
    return description.objects[a].full_contact || description.objects[b].full_contact;
  }
  /// Room for candidates of contact between objects (assumed): 8192, or every knot and edge near another.
  std::size_t mostPairs() const {
    std::size_t knots = 0;
    for (const std::size_t i : bodies) knots += start.objects[i].block.knots();
    return std::max<std::size_t>(8192, 4 * knots);
  }
  std::vector<ConnectionConstants> connections;
  ThreadModel threads;
};

/// @param before  objects that stand the same in it are not computed again; null: all are
/// @throws std::invalid_argument naming object, field, index, value and what is allowed
std::unique_ptr<WorldModel> buildModel(const Description& description, const WorldModel* before = nullptr);
/// The checks alone: finite numbers, masses, indices, duplicates, weights.
void validate(const Description& description);

}  // namespace vest::scene

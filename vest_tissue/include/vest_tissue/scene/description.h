#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/interaction/thermal.h"
#include "vest_tissue/material/law.h"
#include "vest_tissue/motility/motility.h"
#include "vest_tissue/suture/description.h"

/// What a scene says, as plain data: written by modelling and by the loader, read by the World's builder.
/// Lengths in metres, masses in kilograms, frames: world (docs/conventions.md), unless the scene is of
/// another consistent unit system. Nothing here changes after loading.
namespace vest::fem {
struct Description;  // vest_tissue/fem/description.h
}
namespace vest::volume {
struct Brick;  // vest_tissue/volume/brick.h
}
namespace vest::voxel {
struct Volume;  // vest_tissue/voxel/volume.h
}

namespace vest::scene {

using Index = std::uint32_t;

enum class ObjectModel : std::uint8_t { Net = 0, Fem = 1, Volume = 2, Rigid = 3 };
enum class LinkKind : std::uint8_t { Elastic = 0, Viscous = 1, Plastic = 2, Bending = 3 };

/// One spring of the net, counted as such, or a viscous, plastic or bending link.
struct Link {
  LinkKind kind = LinkKind::Elastic;
  Index knot0 = 0;
  Index knot1 = 0;
  Index knot2 = 0;    ///< bending only: knot1 is the middle
  double rest = 0.0;  ///< m; elastic, plastic: rest length; bending: rest angle, rad; viscous: unused
  double area =
      0.0;  ///< m²; elastic: force = area·sigma((l-rest)/rest) by the object's law, if stiffness is 0
  double stiffness = 0.0;  ///< elastic: k, N/m (seed's linear form); plastic: kappa, N; bending: N·m/rad
  double damping = 0.0;    ///< N·s/m along the link (viscous: eta; others: beside the spring)
};

/// Not counted among the springs: keeps the volume inside a closed surface of knots.
/// Energy ½·bulk_modulus·(V-V0)²/V0; the sign of triangles is counter-clockwise from outside.
struct VolumeElement {
  std::vector<std::array<Index, 3>> triangles;  ///< knot indices, closed
  double bulk_modulus = 0.0;                    ///< Pa
  double rest_volume = 0.0;                     ///< m³; 0: that of the rest positions
};

/// Not counted among the springs: bending of a shell across the edge of two triangles.
/// Knots (edge0, edge1, wing0, wing1). Energy: quadratic in the wings' deviation; zero at rest.
struct HingeElement {
  std::array<Index, 4> knots;
  double stiffness = 0.0;  ///< N·m (energy per squared deviation of the dihedral angle)
};

/// Ties a knot to its shape-keeping frame or to a place: a spring from the knot to a fixed point.
/// Not counted among the springs; attachments to the body wall are made of these where `fixed` is too hard.
struct Tether {
  Index knot = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m, world
  double stiffness = 0.0;                           ///< N/m
  double damping = 0.0;                             ///< N·s/m
};

/// How the skin hangs on the knots: position = sum of weights·knots. CSR; weights sum to 1 per vertex.
struct Skin {
  std::vector<std::uint32_t> binding_start;  ///< vertices + 1
  std::vector<std::uint32_t> binding_knots;
  std::vector<float> binding_weights;
  std::vector<std::array<float, 2>> texture_coordinates;  ///< per vertex; u along the organ, v around it
  std::vector<std::array<std::uint32_t, 3>> triangles;    ///< skin vertices, counter-clockwise from outside
  std::vector<std::uint16_t> layer;                       ///< per triangle: 0 outer, 1 inner wall, 2 cut face
};

/// Tubular organs and vessels: station along the centre line <-> ring of knots <-> segment of the vessel
/// network.
struct TubeMap {
  std::vector<double> station;            ///< m, arc length per ring, ascending
  std::vector<std::vector<Index>> rings;  ///< knots per ring, in order around the tube
  std::string vessel_segment;             ///< name in the vessel network, or empty
};

struct Object {
  std::string name;
  std::string organ;               ///< word of the material database
  std::string material;            ///< key of the material database
  std::vector<std::string> roles;  ///< role tags: target, forbidden, …
  ObjectModel model = ObjectModel::Net;
  material::Law law;
  double density = 1000.0;  ///< kg/m³, from the database; knot masses follow from it at baking
  std::vector<Eigen::Vector3d> rest_position;  ///< m, world; shape without load
  std::vector<Eigen::Vector3d> position;       ///< m, world; at the start (in equilibrium under gravity)
  std::vector<double> mass;                    ///< kg per knot, > 0
  std::vector<double> damping;                 ///< gamma_i, N·s/m per knot
  std::vector<std::uint8_t> fixed;             ///< 1: does not move
  std::vector<Link> links;
  std::vector<VolumeElement> volumes;
  std::vector<HingeElement> hinges;
  std::vector<Tether> tethers;
  std::vector<std::array<Index, 3>>
      contact_triangles;              ///< knots, counter-clockwise from outside; what others touch
  double contact_thickness = 0.0005;  ///< m: offset of the touched surface from contact_triangles
  double friction = 0.1;              ///< no unit, Coulomb, wet tissue
  /// It collides with itself, edges meet edges, and what it touches at the start it meets elsewhere.
  bool full_contact = false;
  double tear_strain = 0.0;  ///< no unit: an elastic link tears above this strain; 0: never
  interaction::ThermalMaterial thermal;
  std::vector<double> knot_perfusion;  ///< 1/s per knot, 0 … 1; empty: thermal.perfusion everywhere
  motility::Motility motility;         ///< nets with a tube map only
  double grasp_damage_threshold =
      136e3;  ///< Pa: pinch over the jaw's area that begins to destroy (interaction/heat.h); 0: never
  double cut_toughness = 164.0;  ///< J/m²: work per newly cut area; of liver, 164 ± 6 (Gokgol 2012)
  double puncture_force = 0.4;   ///< N: at which the tip of a suture needle goes in (assumed, of bowel)
  double wall_thickness = 0.0;   ///< m: of a hollow organ; 0: solid
  Skin skin;
  TubeMap tube;
  std::shared_ptr<const fem::Description>
      fem;  ///< model fem or volume: tetrahedra, material, loads; else null
};

/// Ties an anchor of one object to an anchor of another one (ligament to uterus, tube to uterus …).
struct Connection {
  std::string object0, object1;
  Index knot0 = 0;                                   ///< knot of object0
  std::array<Index, 3> triangle1{};                  ///< knots of object1 that carry the anchor
  std::array<double, 3> weights1{};                  ///< barycentric, sum 1
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< m, at rest: knot0 minus anchor, world
  double stiffness = 0.0;                            ///< N/m
  double damping = 0.0;                              ///< N·s/m
  double break_force = 0.0;                          ///< N; 0: never
};

/// A thread that lies in the scene at the start.
struct Suture {
  std::string material, size;                     ///< keys of sutures.yaml
  std::uint8_t kind = 0;                          ///< values of vest_msgs/SutureThread
  double strength = 0.0;                          ///< N, straight
  double knot_strength = 0.0;                     ///< N, in a knot
  double friction = 0.0;                          ///< no unit, on objects: theirs counts where it is more
  std::vector<Eigen::Vector3d> path;              ///< m, world: points that the thread was laid through
  double segment = 0.001;                         ///< m, about that
  std::string needle;                             ///< half, three_eighths, straight, ski; empty: none
  double needle_length = 0.0, needle_wire = 0.0;  ///< m: along it, thickness
  Eigen::Vector3d needle_normal = Eigen::Vector3d::UnitZ();  ///< of the plane that it is bent in
  double loop = 0.0;  ///< m round a loop that is tied beforehand (suture::roederLoop()); 0: none
  Eigen::Vector3d loop_at = Eigen::Vector3d::Zero();      ///< m, world: where its knot begins, in the packet
  Eigen::Vector3d loop_ahead = Eigen::Vector3d::UnitZ(),  ///< from there to the loop's middle,
      loop_across = Eigen::Vector3d::UnitX();             ///< and about across it
  suture::RodDescription rod;                             ///< m, kg, N; its name is the suture's
};

/// Vessels of the scene that the patient's circulation does not have: a network of its own that begins at the
/// end of an artery of his. Files as vest_pulse reads them.
struct VesselTree {
  std::string folder;  ///< below the scene's
  std::string supply;  ///< artery of the patient's network
  std::string case_json, network_csv, inflow_csv;
};

/// What `solution: integrator:` asks for. Nets have their own explicit sub-steps with each of the two dynamic
/// ones.
enum class Integrator : std::uint8_t { NewtonEuler = 0, BackwardEuler = 1, Static = 2 };

struct Description {
  std::string name;
  std::string directory;  ///< where the scene file lies
  std::string source;     ///< spline source that it was baked from, beside it; empty: none
  /// Told what a World prepares for long: object, share of its work, 0 … 1. May be empty.
  std::function<void(const std::string& object, double share)> preparing;
  std::string cache_directory;  ///< where inverses of finite elements are kept between runs; empty: nowhere
  std::string hash;  ///< XXH64, 16 hexadecimal digits, over the scene file and every file it refers to
  Eigen::Vector3d gravity{0, 0, -9.81};
  Integrator integrator = Integrator::NewtonEuler;
  double dt = 0.001;  ///< s
  std::uint32_t seed = 1;
  std::vector<Object> objects;  ///< scene order; rigid ones (cavity) too
  std::vector<Connection> connections;
  std::vector<VesselTree> vessels;
  std::vector<Suture> sutures;              ///< in events they are counted behind the objects
  std::vector<suture::Cylinder> cylinders;  ///< which sutures touch; of vest_simulate alone
  /// What a needle and a probe feel of a patient's image; null: there is none.
  std::shared_ptr<const voxel::Volume> feel;
  std::vector<std::uint16_t> regions;          ///< objects that name its regions, from 1 on
  std::shared_ptr<const volume::Brick> image;  ///< the same image for the eye; null: there is none
};

}  // namespace vest::scene

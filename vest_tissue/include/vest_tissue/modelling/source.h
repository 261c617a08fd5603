#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/layers.h"
#include "vest_tissue/modelling/ring_net.h"
#include "vest_tissue/modelling/tree.h"

/// The spline source of a scene (docs/scene_format.md, "Source"): what people edit; `vest_model bake` makes
/// nets of it.
namespace vest::modelling {

/// Some rings of a net: from first to last in steps; counted from the end when negative in the file.
struct Rings {
  int first = 0, last = -1, step = 1;
  int line = 0;  ///< of the source; 0: not from a file
};

/// Knots that are held: by place along the organ, or because they lie outside a cavity.
struct FixRule {
  std::optional<Rings> rings;
  std::string outside;  ///< object; empty: by rings
  double margin = 0.0;  ///< m; knots nearer than this to the cavity's surface are held too
  int line = 0;         ///< of the source, as in the rules below
};

struct TetherRule {
  Rings rings;
  double stiffness = 0.0;  ///< N/m per knot
};

/// Ties knots to the nearest place on another object's surface.
struct ConnectRule {
  std::string to;
  Rings rings;
  std::uint32_t per_ring = 1;  ///< how many knots of each ring, nearest first
  double within = 0.0;         ///< m; farther ones stay free
  double stiffness = 0.0;      ///< N/m
  int line = 0;
  std::string all_of;  ///< a tree: it is enough that one of its branches is tied
};

/// Moves a surface: all knots near `at` by up to `push` (Gaussian of standard deviations `size`).
struct Bump {
  Vector3 at, size, push;
};

/// Moves the rings of a tube out of other organs, so that nothing overlaps at the start.
struct ClearRule {
  std::string of;
  double gap = 0.0;  ///< m between the surfaces
  int line = 0;
};

/// Lays rings on another organ's surface: their centres end `gap` outside of it (0: half sunk).
struct LayRule {
  std::string on;
  Rings rings;
  double gap = 0.0;  ///< m
  int line = 0;
};

struct ObjectSource {
  std::string file;                 ///< where it stands; empty: nowhere
  std::uint64_t key = 0;            ///< hash of all that the file says of it: two equal ones bake alike
  std::map<std::string, int> line;  ///< of each key in the file
  std::string name, organ, material;
  std::vector<std::string> roles;
  bool rigid = false;
  std::optional<TubeSpec> tube;
  std::optional<SheetSpec> sheet;
  std::optional<RevolveSpec> revolve;
  std::vector<Layer> layers;  ///< outer to inner: elements; none: a net
  std::vector<Bump> bumps;
  std::uint32_t springs = 0;  ///< exact number; 0: as many as the net has with all of `fillers`
  std::vector<LinkClass> fillers;
  std::uint32_t skin_along = 2, skin_around = 2, petals = 0;
  double petal_depth = 0.0;
  std::optional<Vector3> facing;  ///< spreadTexture(); none: the texture of a tube
  double fill = 1.0;  ///< part of the enclosed volume that has the tissue's density (gas in bowel)
  double stiffness_factor = 1.0;  ///< on all areas of links
  double prestrain =
      0.0;  ///< of all links as the source places them: lengths over their rest lengths, less 1
  double damping_ratio = 0.1;  ///< of each link's own pair oscillation
  double damping_rate = 2.0;   ///< 1/s: gamma_i = rate·m_i
  double bulk_modulus = 0.0;   ///< Pa; 0: no volume element
  double support = 0.0;        ///< rad/s; 0: none. Surroundings that carry each knot's weight, and give way:
                         ///< a tether of stiffness m·support² whose place lies m·g/stiffness above the design
  double contact_thickness = 0.0005;
  bool full_contact = false;    ///< as scene::Object
  double puncture_force = 0.4;  ///< N, as scene::Object
  std::optional<double> friction, cut_toughness, tear_strain,
      grasp_damage_threshold;  ///< as scene::Object; none: what the database says of the material
  double inner_wall = 0.0;     ///< m: wall that a cut shows; 0: tube's wall_thickness (0 too: solid)
  std::string vessel_segment;
  motility::Motility motility;
  std::vector<FixRule> fixed;
  std::vector<TetherRule> tethers;
  std::vector<ConnectRule> connections;
  std::vector<LayRule> lay;  ///< before clear
  std::vector<ClearRule> clear;
};

/// A tree whose branches are objects.
struct TreeSource {
  std::string name, material;
  TreeSpec spec;
  std::vector<TreeBranch> branches;
};

/// Tissues by name.
using Materials = std::map<std::string, material::Tissue>;

struct SceneSource {
  std::string name;
  Vector3 gravity{0, 0, -9.81};
  double dt = 0.001;
  std::uint32_t seed = 1;
  std::vector<ObjectSource> objects;  ///< its own, then those of the parts
  std::vector<TreeSource> trees;
  std::vector<scene::Suture> sutures;
  std::vector<std::string> parts;  ///< included files of its own, relative to its folder
};

/// A source and the parts that it includes. @throws std::invalid_argument: file, line, field, value, what is
/// allowed
SceneSource readSource(const std::string& path);
/// The same of a text that stands, or shall stand, at a path.
SceneSource readSource(const std::string& path, const std::string& text);
/// One object alone, such as Document::bytes() gives it, without what it refers to; a tree with its branches.
/// @throws std::invalid_argument, also where it is the mirror of another one
SceneSource readAlone(const std::string& text);

/// data/materials.yaml. @throws std::invalid_argument
Materials readMaterials(const std::string& path);

}  // namespace vest::modelling

#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "vest_viz/mesh/cut_surface.h"

/// What a viewer keeps of the tissue: topology with its deltas, the newest state, skins rebuilt from it.
/// Nothing here knows ROS; whatever arrives (empty, late, repeated, unknown revision, NaN) leaves the store
/// usable.
namespace vest::mesh {

/// Topology of one object; fields and units as in vest_msgs/TissueObject.
struct Object {
  std::string name;
  std::string organ;
  std::string material;  ///< key of the material database; empty if unknown
  std::uint16_t segmentation_label = 0;
  bool rigid = false;
  std::uint32_t knot_count = 0;
  std::vector<float> rest_position;  ///< m, world; x y z per knot
  std::vector<std::uint8_t> knot_fixed;
  std::vector<std::uint32_t> link_knots;  ///< two per link
  std::vector<std::uint8_t> link_kind;    ///< TissueObject.LINK_*; may be empty
  std::vector<std::uint8_t> link_alive;
  std::vector<std::uint32_t> triangles;  ///< three skin vertices each, counter-clockwise from outside
  std::vector<std::uint16_t> triangle_layer;
  std::vector<float> texture_coordinates;    ///< u v per skin vertex
  std::vector<std::uint32_t> binding_start;  ///< vertices + 1
  std::vector<std::uint32_t> binding_knots;
  std::vector<float> binding_weights;
  std::vector<std::uint32_t> tetrahedra;  ///< four knots each; deltas do not carry them, whole topologies do
  std::vector<std::uint16_t> tetrahedron_material;  ///< may be empty: one material

  std::size_t vertexCount() const { return binding_start.empty() ? 0 : binding_start.size() - 1; }
};

struct Topology {
  std::uint32_t revision = 0;
  std::string scene;
  std::vector<Object> objects;
};

/// As vest_msgs/TissueTopologyDelta. Indices never shift: a removed triangle stays, without area.
struct Delta {
  std::uint32_t from_revision = 0;
  std::uint32_t revision = 0;
  std::uint16_t object = 0;
  std::vector<std::uint32_t> removed_links, added_link_knots, doubled_knots, removed_triangles,
      added_triangles;
  std::vector<std::uint8_t> added_link_kind;  ///< may be empty: elastic
  std::vector<std::uint16_t> added_triangle_layer;
  std::vector<float> added_texture_coordinates;
  std::vector<std::uint32_t> added_binding_start, added_binding_knots;
  std::vector<float> added_binding_weights;
  std::vector<std::uint32_t> rebound_vertices, rebound_start, rebound_knots;
  std::vector<float> rebound_weights;
};

/// Layers of TissueObject.triangle_layer.
constexpr std::uint16_t kOuterSkin = 0, kInnerWall = 1, kCutFace = 2;

/// Arrays that a renderer uploads; rebuilt by Store::rebuildSkins(). Where a cut face shares a vertex with
/// the skin the vertex is doubled, so that the edge of the cut stays sharp: the doubles follow after those of
/// the topology.
struct Skin {
  std::vector<float> positions;  ///< m, world; x y z per vertex
  std::vector<float> normals;    ///< unit length
  std::vector<float> tangents;   ///< direction of growing u, unit length, not yet orthogonal to the normal
  std::vector<std::uint32_t> triangles;  ///< as in the topology, with the doubles
  std::vector<std::uint32_t> doubled;    ///< skin vertex of each double
  std::vector<float> uv;                 ///< u v per vertex; empty if the object has none
  CutSurface cut;                        ///< how the walls of its cuts are drawn
  std::size_t vertexCount() const { return positions.size() / 3; }
};

/// A value per knot of all objects, as vest_msgs/TissueField: minimum + data · (maximum - minimum) / 255.
struct Field {
  std::uint8_t kind = 0;
  float minimum = 0, maximum = 1;  ///< unit of the kind
  std::vector<std::uint8_t> data;  ///< one per knot, objects in scene order
};

enum class Outcome : std::uint8_t {
  Accepted,         ///< taken over
  Repeated,         ///< the same revision again, nothing to do
  UnknownRevision,  ///< state or delta of a revision that this store does not have: dropped
  Malformed,  ///< sizes or indices contradict each other: dropped (or, in a topology, that object emptied)
  NotFinite   ///< NaN or infinite positions: objects concerned keep their last shape
};

class Store {
 public:
  /// Takes a whole topology. Objects whose arrays contradict each other stay in the list, empty, and are
  /// named in problem(). A topology with the present revision and the same objects is Repeated unless
  /// `problem` persists.
  Outcome setTopology(Topology topology);

  /// Applies a delta that starts from the present revision.
  Outcome applyDelta(const Delta& delta);

  /// New positions of all knots, x y z, objects in scene order.
  /// @param count number of floats, 3 · sum of knot counts
  Outcome setState(std::uint32_t revision, const float* positions, std::size_t count);

  /// A value per knot of all objects. It stays until the next one of its kind, and through cuts.
  Outcome setField(std::uint32_t revision, const Field& field);
  /// Null if none of this kind came.
  const Field* field(std::uint8_t kind) const;
  const std::vector<Field>& fields() const { return fields_; }
  /// Grows with every field taken over.
  std::uint64_t fieldVersion() const { return field_version_; }
  /// The field at the vertices of an object's skin, mapped so that `low` is 0 and `high` 1, and clamped.
  /// @param out   skin(object).vertexCount() numbers, `stride` apart
  /// @return the largest of them; 0 and zeros if there is no such field
  float vertexField(std::size_t object, std::uint8_t kind, float low, float high, std::uint8_t* out,
                    std::size_t stride) const;
  /// Largest value at an object's knots, mapped likewise: no vertex is above it. 0 if there is no such field.
  float largestAtKnots(std::size_t object, std::uint8_t kind, float low, float high) const;
  /// Value at a knot; NaN if there is no such field.
  float knotField(std::size_t object, std::uint8_t kind, std::size_t knot) const;

  /// Rebuilds positions, normals and tangents of all skins whose knots moved since the last call.
  void rebuildSkins();

  const Topology& topology() const { return topology_; }
  bool empty() const { return topology_.objects.empty(); }
  const Skin& skin(std::size_t object) const { return skins_[object]; }
  const float* knots(std::size_t object) const { return knots_.data() + 3 * first_knot_[object]; }
  /// Grows whenever triangles, texture coordinates or the number of vertices of any object change.
  std::uint64_t shapeVersion() const { return shape_version_; }
  /// The same of one object.
  std::uint64_t shapeVersion(std::size_t object) const { return object_version_[object]; }
  /// True if the last rebuildSkins() changed this object.
  bool moved(std::size_t object) const { return moved_[object] != 0; }
  /// What was wrong with the last thing that was not fully accepted; names object and field.
  const std::string& problem() const { return problem_; }

 private:
  void layOut(const std::vector<float>* old_knots, std::size_t changed);

  Topology topology_;
  std::vector<std::size_t> first_knot_;
  std::vector<float> knots_;
  std::vector<Skin> skins_;
  std::vector<std::uint8_t> dirty_, moved_;
  std::uint64_t shape_version_ = 0, field_version_ = 0;
  std::vector<std::uint64_t> object_version_;
  std::vector<Field> fields_;
  std::string problem_;
};

/// Empty if the object is consistent, else a message "object NAME: FIELD …".
std::string validate(const Object& object);

/// Unit tangents along u per vertex, area-weighted; some direction across the normal where u does not vary.
void vertexTangents(const float* positions, const float* uv, const float* normals, std::size_t vertices,
                    const std::uint32_t* triangles, std::size_t triangle_count, float* tangents);

/// Metres of skin per unit of texture coordinate: sqrt(area in space / area in uv) over the whole object,
/// so that baked patterns have their true size whatever unit a scene gives its coordinates. 0 if undefined.
double metresPerTextureUnit(const Object& object, const float* positions);

}  // namespace vest::mesh

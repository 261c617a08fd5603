#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// What a viewer keeps of the tissue: topology with its deltas, the newest state, skins rebuilt from it.
/// Nothing here knows ROS; whatever arrives (empty, late, repeated, unknown revision, NaN) leaves the store
/// usable.
namespace vest::mesh {

/// Topology of one object; fields and units as in vest_msgs/TissueObject.
struct Object {
  std::string name;
  std::string organ;
  std::uint16_t segmentation_label = 0;
  bool rigid = false;
  std::uint32_t knot_count = 0;
  std::vector<float> rest_position;  ///< m, world; x y z per knot
  std::vector<std::uint8_t> knot_fixed;
  std::vector<std::uint32_t> link_knots;  ///< two per link
  std::vector<std::uint8_t> link_alive;
  std::vector<std::uint32_t> triangles;  ///< three skin vertices each, counter-clockwise from outside
  std::vector<std::uint16_t> triangle_layer;
  std::vector<float> texture_coordinates;    ///< u v per skin vertex
  std::vector<std::uint32_t> binding_start;  ///< vertices + 1
  std::vector<std::uint32_t> binding_knots;
  std::vector<float> binding_weights;

  std::size_t vertexCount() const { return binding_start.empty() ? 0 : binding_start.size() - 1; }
};

struct Topology {
  std::uint32_t revision = 0;
  std::string scene;
  std::vector<Object> objects;
};

/// As vest_msgs/TissueTopologyDelta. Indices of triangles are those of the living ones before the delta.
struct Delta {
  std::uint32_t from_revision = 0;
  std::uint32_t revision = 0;
  std::uint16_t object = 0;
  std::vector<std::uint32_t> removed_links, added_link_knots, doubled_knots, removed_triangles,
      added_triangles;
  std::vector<std::uint16_t> added_triangle_layer;
  std::vector<float> added_texture_coordinates;
  std::vector<std::uint32_t> added_binding_start, added_binding_knots;
  std::vector<float> added_binding_weights;
  std::vector<std::uint32_t> rebound_vertices, rebound_start, rebound_knots;
  std::vector<float> rebound_weights;
};

/// Arrays that a renderer uploads; rebuilt by Store::rebuildSkins().
struct Skin {
  std::vector<float> positions;  ///< m, world; x y z per vertex
  std::vector<float> normals;    ///< unit length
  std::vector<float> tangents;   ///< direction of growing u, unit length, not yet orthogonal to the normal
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

  /// Rebuilds positions, normals and tangents of all skins whose knots moved since the last call.
  void rebuildSkins();

  const Topology& topology() const { return topology_; }
  bool empty() const { return topology_.objects.empty(); }
  const Skin& skin(std::size_t object) const { return skins_[object]; }
  const float* knots(std::size_t object) const { return knots_.data() + 3 * first_knot_[object]; }
  /// Grows whenever triangles, texture coordinates or the number of vertices of any object change.
  std::uint64_t shapeVersion() const { return shape_version_; }
  /// True if the last rebuildSkins() changed this object.
  bool moved(std::size_t object) const { return moved_[object] != 0; }
  /// What was wrong with the last thing that was not fully accepted; names object and field.
  const std::string& problem() const { return problem_; }

 private:
  void layOut(const std::vector<float>* old_knots);

  Topology topology_;
  std::vector<std::size_t> first_knot_;
  std::vector<float> knots_;
  std::vector<Skin> skins_;
  std::vector<std::uint8_t> dirty_, moved_;
  std::uint64_t shape_version_ = 0;
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

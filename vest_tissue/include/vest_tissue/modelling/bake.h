#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vest_tissue/base/box_tree.h"
#include "vest_tissue/modelling/source.h"
#include "vest_tissue/scene/description.h"

namespace vest::modelling {

/// Nearest point of a triangle surface.
struct NearestPoint {
  std::size_t triangle = 0;
  std::array<double, 3> weights{};    ///< barycentric
  Vector3 point = Vector3::Zero();    ///< m
  Vector3 normal = Vector3::UnitZ();  ///< unit, outward
  double distance = 0.0;              ///< m, signed by the pseudo-normal of the nearest triangles: < 0 inside
};
/// Ericson, Real-Time Collision Detection, 2005, section 5.1.5 (closest point on a triangle), of those that a
/// tree of boxes leaves; of several at one distance the first. The sign follows the angle-weighted
/// pseudo-normal, Baerentzen, Aanaes, IEEE TVCG 11(3), 2005, doi:10.1109/TVCG.2005.49.
class NearestPoints {
 public:
  /// Both stay as they are while it is asked.
  NearestPoints(const std::vector<Vector3>& points,
                const std::vector<std::array<std::uint32_t, 3>>& triangles);
  /// Of the surface to a place; there is a triangle.
  NearestPoint operator()(const Vector3& place) const;

 private:
  const std::vector<Vector3>& points_;
  const std::vector<std::array<std::uint32_t, 3>>& triangles_;
  contact::BoxTree tree_;
  std::vector<std::uint32_t> begin_, of_point_;  ///< triangles of each point, in rising order
  double rounding_ = 0;                          ///< m
};
/// One question alone.
inline NearestPoint nearestPoint(const std::vector<Vector3>& points,
                                 const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                 const Vector3& place) {
  return NearestPoints(points, triangles)(place);
}

/// What a bake keeps for the next one: an object is made anew only where the source says something else of
/// it, or of what it lies on, clears, or is held by. For sources that were read, of one material database.
class BakeCache {
 public:
  std::vector<std::string> rebuilt;  ///< objects that the last bake made anew, in scene order

  template <class T>
  struct Kept {
    std::uint64_t key = 0;
    std::shared_ptr<const T> value;
  };
  struct Entry {
    Kept<RingNet> drawn, laid, cleared;
    Kept<scene::Object> object;
    Kept<std::vector<std::vector<scene::Connection>>> connections;  ///< per rule
    bool used = false;
  };
  std::map<std::string, Entry> entries;
};

/// Nets, skins, masses, attachments and connections of a whole scene. Deterministic.
/// @param cache may be null @throws std::invalid_argument naming object and field
scene::Description bake(const SceneSource& source, const Materials& materials, BakeCache* cache = nullptr);

/// Writes NAME.yaml, NAME_connections.csv and one baked net per object into a folder, which is made where it
/// is missing; with `source_bytes` also the source itself, which the scene names. All of them or none.
/// @throws std::runtime_error
void writeScene(const scene::Description& description, const std::string& directory,
                const std::string& source_file, const std::string& source_bytes = {});

/// Stiffness of a link at rest, N/m: E·area/rest by the law, or its own.
double linkStiffness(const scene::Object& object, const scene::Link& link);

/// Highest angular frequency of an object's links at rest, rad/s (power iteration on the linearised net).
double highestFrequency(const scene::Object& object);

}  // namespace vest::modelling

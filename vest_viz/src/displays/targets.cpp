#include "targets.h"

#include <algorithm>
#include <limits>

#include "vest_viz/effects/shapes.h"

namespace vest::displays {
namespace {
constexpr double kInk = 0.00025;  // m: half the width of a surgical skin marker's fine line; assumed
constexpr std::size_t kMostLines = 100, kMostPoints = 200;

const mesh::Object* objectOf(const mesh::Store& store, const std::string& name, std::size_t* index) {
  const auto& objects = store.topology().objects;
  const auto it =
      std::find_if(objects.begin(), objects.end(), [&](const mesh::Object& o) { return o.name == name; });
  *index = static_cast<std::size_t>(it - objects.begin());
  return it == objects.end() ? nullptr : &*it;
}
}  // namespace

void Targets::set(const visualization_msgs::MarkerArray& markers) {
  lines_.clear();
  scene_.clear();
  for (const visualization_msgs::Marker& m : markers.markers) {
    if (m.type != visualization_msgs::Marker::LINE_STRIP || m.action != visualization_msgs::Marker::ADD ||
        m.points.size() > kMostPoints || lines_.size() >= kMostLines)
      continue;
    Line line;
    line.object = m.ns;
    for (const auto& p : m.points) line.rest.emplace_back(Eigen::Vector3d(p.x, p.y, p.z).cast<float>());
    if (line.rest.size() > 1 && line.rest.front() == line.rest.back()) line.rest.pop_back();
    const bool finite = std::all_of(line.rest.begin(), line.rest.end(),
                                    [](const Eigen::Vector3f& p) { return p.allFinite(); });
    if (finite && line.rest.size() >= 3) lines_.push_back(std::move(line));
  }
}

void Targets::fasten(const mesh::Store& store, Line* line) const {
  line->points.clear();
  std::size_t index = 0;
  const mesh::Object* object = objectOf(store, line->object, &index);
  if (object == nullptr || object->knot_count == 0) return;
  for (const Eigen::Vector3f& p : line->rest) {
    float nearest = std::numeric_limits<float>::max();
    Point point{};
    for (std::size_t k = 0; 3 * k + 2 < object->rest_position.size(); ++k) {
      const Eigen::Vector3f off = p - Eigen::Map<const Eigen::Vector3f>(&object->rest_position[3 * k]);
      if (off.squaredNorm() < nearest) nearest = off.squaredNorm(), point = {k, off};
    }
    line->points.push_back(point);
  }
}

instrument::TriangleMesh Targets::mesh(const mesh::Store& store) {
  instrument::TriangleMesh all;
  if (lines_.empty() || store.empty()) return all;
  if (scene_ != store.topology().scene) {
    scene_ = store.topology().scene;
    for (Line& line : lines_) fasten(store, &line);
  }
  for (const Line& line : lines_) {
    std::size_t index = 0;
    const mesh::Object* object = objectOf(store, line.object, &index);
    if (object == nullptr || line.points.empty()) continue;
    const float* const knots = store.knots(index);
    std::vector<float> xyz;
    for (const Point& p : line.points) {
      if (p.knot >= object->knot_count) return {};
      for (int axis = 0; axis < 3; ++axis) xyz.push_back(knots[3 * p.knot + axis] + p.offset[axis]);
    }
    effects::append(&all, effects::tube(xyz.data(), line.points.size(), kInk, true),
                    Eigen::Isometry3d::Identity());
  }
  return all;
}

}  // namespace vest::displays

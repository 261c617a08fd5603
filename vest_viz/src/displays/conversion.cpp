#include "conversion.h"

#include <cmath>

namespace vest::displays {

mesh::Topology toTopology(const vest_msgs::TissueTopology& message) {
  mesh::Topology t;
  t.revision = message.revision;
  t.scene = message.scene;
  t.objects.reserve(message.objects.size());
  for (const vest_msgs::TissueObject& m : message.objects) {
    mesh::Object o;
    o.name = m.name;
    o.organ = m.organ;
    o.segmentation_label = m.segmentation_label;
    o.material = m.material;
    o.link_kind = m.link_kind;
    o.rigid = m.model == vest_msgs::TissueObject::MODEL_RIGID;
    o.knot_count = m.knot_count;
    o.rest_position = m.rest_position;
    o.knot_fixed = m.knot_fixed;
    o.link_knots = m.link_knots;
    o.link_alive = m.link_alive;
    o.triangles = m.triangles;
    o.triangle_layer = m.triangle_layer;
    o.texture_coordinates = m.texture_coordinates;
    o.binding_start = m.binding_start;
    o.binding_knots = m.binding_knots;
    o.binding_weights = m.binding_weights;
    o.tetrahedra = m.tetrahedra;
    o.tetrahedron_material = m.tetrahedron_material;
    t.objects.push_back(std::move(o));
  }
  return t;
}

mesh::Delta toDelta(const vest_msgs::TissueTopologyDelta& m) {
  mesh::Delta d;
  d.from_revision = m.from_revision;
  d.revision = m.revision;
  d.object = m.object;
  d.removed_links = m.removed_links;
  d.added_link_kind = m.added_link_kind;
  d.added_link_knots = m.added_link_knots;
  d.doubled_knots = m.doubled_knots;
  d.removed_triangles = m.removed_triangles;
  d.added_triangles = m.added_triangles;
  d.added_triangle_layer = m.added_triangle_layer;
  d.added_texture_coordinates = m.added_texture_coordinates;
  d.added_binding_start = m.added_binding_start;
  d.added_binding_knots = m.added_binding_knots;
  d.added_binding_weights = m.added_binding_weights;
  d.rebound_vertices = m.rebound_vertices;
  d.rebound_start = m.rebound_start;
  d.rebound_knots = m.rebound_knots;
  d.rebound_weights = m.rebound_weights;
  return d;
}

bool toPose(const geometry_msgs::Pose& m, Eigen::Isometry3d* pose) {
  const Eigen::Vector3d p(m.position.x, m.position.y, m.position.z);
  const Eigen::Quaterniond q(m.orientation.w, m.orientation.x, m.orientation.y, m.orientation.z);
  if (!p.allFinite() || !q.coeffs().allFinite() || std::fabs(q.norm() - 1) > 0.01) return false;
  *pose = Eigen::Isometry3d::Identity();
  pose->translation() = p;
  pose->linear() = q.normalized().toRotationMatrix();
  return true;
}

bool toOpticalFrame(const vest_msgs::InstrumentState& endoscope, Eigen::Isometry3d* pose) {
  if (!toPose(endoscope.tip, pose)) return false;
  const Eigen::Vector3d sight(endoscope.sight[0], endoscope.sight[1], endoscope.sight[2]);
  if (std::fabs(sight.norm() - 1) < 0.01)  // of an optic that nobody describes: straight
    pose->rotate(Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), sight));
  return true;
}

std::string toBrick(const vest_msgs::ImageVolume& message, volume::Brick* brick) {
  double voxels = 1;
  for (int a = 0; a < 3; ++a) {
    brick->size[a] = message.size[a];
    voxels *= message.size[a];
    brick->origin[a] = message.origin[a];
    for (int b = 0; b < 3; ++b) brick->axes(a, b) = message.axes[3 * a + b];
  }
  if (!(voxels > 0 && voxels == static_cast<double>(message.stored.size())))
    return "size: does not go with the number of values";
  const Eigen::Vector3d spacing = brick->axes.colwise().norm().transpose();
  const bool in_space = brick->origin.allFinite() && brick->axes.allFinite() && spacing.minCoeff() > 1e-6 &&
                        spacing.maxCoeff() < 1 && std::abs(brick->axes.determinant()) > 1e-3 * spacing.prod();
  if (!in_space) return "origin, axes: must be finite, voxels of 1 um to 1 m, and axes that fill space";
  if (!std::isfinite(message.intercept) || !std::isfinite(message.slope) || message.slope == 0)
    return "slope, intercept: must be finite, and a slope that is not 0";
  brick->slope = message.slope, brick->intercept = message.intercept;
  brick->unit = message.value_unit;
  brick->stored = message.stored;
  if (message.nothing != volume::Brick::kNothing)
    for (std::int16_t& number : brick->stored) {
      if (number == message.nothing)
        number = volume::Brick::kNothing;
      else if (number == volume::Brick::kNothing)
        ++number;
    }
  return {};
}

sensor_msgs::CameraInfo toCameraInfo(const camera::Intrinsics& c) {
  sensor_msgs::CameraInfo info;
  info.width = c.width;
  info.height = c.height;
  const bool fisheye = c.model == camera::Distortion::Equidistant;
  info.distortion_model = fisheye ? "equidistant" : "plumb_bob";
  info.D.assign(c.distortion.begin(), c.distortion.begin() + (fisheye ? 4 : 5));
  info.K = {c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1};
  info.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.P = {c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0};
  return info;
}

}  // namespace vest::displays

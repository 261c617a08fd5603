#include "vest_tissue/ros/drawn_scene.h"

#include "vest_instruments/ros/frames.h"
#include "vest_tissue/fem/description.h"

namespace vest::ros_shell {

void tubeToMsg(const scene::TubeMap& tube, vest_msgs::TissueObject& msg) {
  msg.ring_start.clear();
  if (!tube.rings.empty()) msg.ring_start.push_back(0);
  for (std::size_t r = 0; r < tube.rings.size(); ++r) {
    msg.centre_line_station.push_back(static_cast<float>(tube.station[r]));
    msg.ring_knots.insert(msg.ring_knots.end(), tube.rings[r].begin(), tube.rings[r].end());
    msg.ring_start.push_back(static_cast<std::uint32_t>(msg.ring_knots.size()));
  }
  msg.vessel_segment = tube.vessel_segment;
}

vest_msgs::TissueTopology topologyOf(const scene::Description& scene) {
  vest_msgs::TissueTopology topology;
  topology.header.frame_id = frameId("world");
  topology.revision = 1;
  topology.scene = scene.name;
  topology.scene_hash = scene.hash;
  for (const scene::Object& o : scene.objects) {
    vest_msgs::TissueObject m;
    m.name = o.name;
    m.id = static_cast<std::uint16_t>(topology.objects.size());
    m.segmentation_label = static_cast<std::uint16_t>(m.id + 1);
    m.organ = o.organ;
    m.material = o.material;
    m.roles = o.roles;
    m.model = static_cast<std::uint8_t>(o.model);
    m.knot_count = static_cast<std::uint32_t>(o.rest_position.size());
    for (const Eigen::Vector3d& p : o.rest_position)
      for (int k = 0; k < 3; ++k) m.rest_position.push_back(static_cast<float>(p[k]));
    m.knot_fixed = o.fixed;
    for (const scene::Link& link : o.links) {
      m.link_knots.insert(m.link_knots.end(),
                          {link.knot0, link.kind == scene::LinkKind::Bending ? link.knot2 : link.knot1});
      m.link_kind.push_back(static_cast<std::uint8_t>(link.kind));
      m.link_alive.push_back(1);
    }
    for (const auto& t : o.skin.triangles) m.triangles.insert(m.triangles.end(), t.begin(), t.end());
    m.triangle_layer = o.skin.layer;
    for (const auto& uv : o.skin.texture_coordinates)
      m.texture_coordinates.insert(m.texture_coordinates.end(), uv.begin(), uv.end());
    m.binding_start = o.skin.binding_start;
    m.binding_knots = o.skin.binding_knots;
    m.binding_weights = o.skin.binding_weights;
    if (o.fem && o.fem->motion != fem::Motion::Condensed) {
      for (const auto& corner : o.fem->tetrahedra)
        m.tetrahedra.insert(m.tetrahedra.end(), corner.begin(), corner.end());
      m.tetrahedron_material = o.fem->cell_material;
    }
    tubeToMsg(o.tube, m);
    topology.objects.push_back(std::move(m));
  }
  return topology;
}

vest_msgs::TissueState stateOf(const scene::Description& scene, const vest_msgs::TissueTopology& topology) {
  vest_msgs::TissueState state;
  state.header = topology.header;
  state.revision = topology.revision;
  for (const scene::Object& o : scene.objects)
    for (std::size_t i = 0; i < o.rest_position.size(); ++i)
      for (int k = 0; k < 3; ++k)
        state.positions.push_back(
            static_cast<float>((i < o.position.size() ? o.position[i] : o.rest_position[i])[k]));
  return state;
}

}  // namespace vest::ros_shell

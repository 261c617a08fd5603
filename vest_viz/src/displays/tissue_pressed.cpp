// Skins that are drawn elsewhere than the tissue is: between the jaws that hold it, and a wall that has sunk.
#include "tissue_visual.h"
#include "vest_tissue/net/skin.h"

namespace vest::displays {

void TissueVisual::setSunk(double metres, const Eigen::Vector3d& lens, std::vector<mesh::TentPole> shafts) {
  sunk_ = metres, lens_ = lens, tent_poles_ = std::move(shafts);
}

bool TissueVisual::press(const mesh::Store& store, std::size_t index) {
  Part& part = parts_[index];
  const auto held = held_.find(part.name);
  const bool was = !part.pressed.empty(), sinks = sunk_ > mesh::kSeenSunk && part.organ == "cavity";
  part.pressed.clear();
  if (held == held_.end() && !sinks) return was;
  const mesh::Skin& skin = store.skin(index);
  part.pressed = skin.positions;
  bool any = sinks;
  if (sinks) mesh::sinkWall(sunk_, lens_, tent_poles_, &part.pressed);
  if (held != held_.end())
    for (const instrument::Jaws& jaws : held->second)
      any = instrument::pressBetween(jaws, &part.pressed) || any;
  if (!any) {
    part.pressed.clear();
    return was;
  }
  part.pressed_normals.resize(part.pressed.size());
  net::vertexNormals(part.pressed.data(), skin.vertexCount(), skin.triangles.data(),
                     skin.triangles.size() / 3, part.pressed_normals.data());
  return true;
}

void TissueVisual::upload(const mesh::Store& store, std::size_t index) {
  const mesh::Skin& skin = store.skin(index);
  const Part& part = parts_[index];
  const bool elsewhere = part.pressed.size() == skin.positions.size() && !part.pressed.empty();
  const std::vector<float>&places = elsewhere ? part.pressed : skin.positions,
        &directions = elsewhere ? part.pressed_normals : skin.normals;
  if (!fine(part)) {
    part.mesh->setVertices(places, directions, skin.tangents);
    return;
  }
  std::vector<float> positions = places, normals = directions, tangents = skin.tangents;
  for (auto* values : {&positions, &normals, &tangents}) part.refined.append(3, values);
  part.mesh->setVertices(positions, normals, tangents);
}

}  // namespace vest::displays

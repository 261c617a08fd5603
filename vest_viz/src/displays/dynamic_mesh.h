#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <OgreEntity.h>
#include <OgreHardwareVertexBuffer.h>
#include <OgreMesh.h>

#include "vest_viz/instrument/stl.h"
#include "vest_viz/mesh/store.h"

namespace Ogre {
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace vest::displays {

/// An OGRE mesh whose vertices move: one interleaved dynamic buffer (position, normal, tangent) that is
/// discarded and filled anew, beside a static one (texture coordinates, tint).
class DynamicMesh {
 public:
  /// @param node parent; @param queue render queue group
  DynamicMesh(Ogre::SceneManager* manager, Ogre::SceneNode* node, const Ogre::MaterialPtr& material,
              std::uint8_t queue);
  ~DynamicMesh();
  DynamicMesh(const DynamicMesh&) = delete;
  DynamicMesh& operator=(const DynamicMesh&) = delete;

  /// Triangles drawn with one material.
  struct Group {
    std::vector<std::uint32_t> triangles;
    Ogre::MaterialPtr material;
  };
  /// New triangles and static attributes. Groups without triangles are left out.
  /// @param uv   u v per vertex, in tiles; @param tint r g b occlusion per vertex, 0 … 1 (tint halved: 0.5 is
  /// 1)
  void setShape(const std::vector<Group>& groups, const std::vector<float>& uv,
                const std::vector<float>& tint, std::size_t vertices);
  /// The same with one group and the material of the constructor.
  void setShape(const std::vector<std::uint32_t>& triangles, const std::vector<float>& uv,
                const std::vector<float>& tint, std::size_t vertices);
  /// New positions; as many vertices as setShape() said. Tangents may be empty.
  void setVertices(const std::vector<float>& positions, const std::vector<float>& normals,
                   const std::vector<float>& tangents);
  /// Bytes per vertex, 0 … 255: what happened to tissue (tissue.vert), or a colour in the first three.
  static constexpr std::size_t kState = 7;
  void setState(const std::vector<std::uint8_t>& state);
  /// Another material for the group with this index of setShape().
  void setMaterial(std::size_t group, const Ogre::MaterialPtr& material);
  void setVisible(bool visible);
  Ogre::SceneNode* node() { return node_; }

 private:
  void destroyEntity();

  Ogre::SceneManager* manager_;
  Ogre::SceneNode* node_;
  Ogre::MaterialPtr material_;
  std::uint8_t queue_;
  Ogre::MeshPtr mesh_;
  Ogre::Entity* entity_ = nullptr;
  Ogre::HardwareVertexBufferSharedPtr moving_, state_;
  std::vector<int> sub_entities_;  ///< per group; -1: has no triangles
  std::size_t vertices_ = 0;
  bool visible_ = true;
};

}  // namespace vest::displays

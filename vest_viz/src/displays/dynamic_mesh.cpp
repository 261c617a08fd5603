#include "dynamic_mesh.h"

#include <algorithm>
#include <cstring>

#include <OgreHardwareBufferManager.h>
#include <OgreMeshManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreSubEntity.h>
#include <OgreSubMesh.h>

#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {

DynamicMesh::DynamicMesh(Ogre::SceneManager* manager, Ogre::SceneNode* node,
                         const Ogre::MaterialPtr& material, std::uint8_t queue)
    : manager_(manager), node_(node->createChildSceneNode()), material_(material), queue_(queue) {}

DynamicMesh::~DynamicMesh() {
  destroyEntity();
  node_->getParentSceneNode()->removeChild(node_);
  manager_->destroySceneNode(node_);
}

void DynamicMesh::destroyEntity() {
  if (entity_ != nullptr) {
    node_->detachObject(entity_);
    manager_->destroyEntity(entity_);
    entity_ = nullptr;
  }
  drop(mesh_);
  moving_ = Ogre::HardwareVertexBufferSharedPtr();
  state_ = Ogre::HardwareVertexBufferSharedPtr();
}

void DynamicMesh::setVisible(bool visible) {
  visible_ = visible;
  if (entity_ != nullptr) entity_->setVisible(visible);
}

void DynamicMesh::setShape(const std::vector<std::uint32_t>& triangles, const std::vector<float>& uv,
                           const std::vector<float>& tint, std::size_t vertices) {
  setShape({Group{triangles, material_}}, uv, tint, vertices);
}

void DynamicMesh::setShape(const std::vector<Group>& groups, const std::vector<float>& uv,
                           const std::vector<float>& tint, std::size_t vertices) {
  destroyEntity();
  vertices_ = vertices;
  sub_entities_.assign(groups.size(), -1);
  const bool any =
      std::any_of(groups.begin(), groups.end(), [](const Group& g) { return !g.triangles.empty(); });
  if (vertices == 0 || !any) return;
  mesh_ = Ogre::MeshManager::getSingleton().createManual(uniqueName("mesh"), kOgreGroup);
  mesh_->sharedVertexData = new Ogre::VertexData();
  Ogre::VertexData* data = mesh_->sharedVertexData;
  data->vertexCount = vertices;
  Ogre::VertexDeclaration* declaration = data->vertexDeclaration;
  declaration->addElement(0, 0, Ogre::VET_FLOAT3, Ogre::VES_POSITION);
  declaration->addElement(0, 12, Ogre::VET_FLOAT3, Ogre::VES_NORMAL);
  declaration->addElement(0, 24, Ogre::VET_FLOAT3, Ogre::VES_TEXTURE_COORDINATES, 1);
  declaration->addElement(1, 0, Ogre::VET_FLOAT2, Ogre::VES_TEXTURE_COORDINATES, 0);
  declaration->addElement(1, 8, Ogre::VET_FLOAT4, Ogre::VES_DIFFUSE);
  declaration->addElement(2, 0, Ogre::VET_FLOAT4, Ogre::VES_TEXTURE_COORDINATES, 2);
  declaration->addElement(2, 16, Ogre::VET_FLOAT3, Ogre::VES_TEXTURE_COORDINATES, 3);
  constexpr std::size_t kStateBytes = kState * sizeof(float);
  auto& buffers = Ogre::HardwareBufferManager::getSingleton();
  moving_ =
      buffers.createVertexBuffer(36, vertices, Ogre::HardwareBuffer::HBU_DYNAMIC_WRITE_ONLY_DISCARDABLE);
  state_ = buffers.createVertexBuffer(kStateBytes, vertices,
                                      Ogre::HardwareBuffer::HBU_DYNAMIC_WRITE_ONLY_DISCARDABLE);
  auto fixed = buffers.createVertexBuffer(24, vertices, Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY);
  std::vector<float> rows(6 * vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    rows[6 * v] = uv.empty() ? 0.0f : uv[2 * v];
    rows[6 * v + 1] = uv.empty() ? 0.0f : uv[2 * v + 1];
    for (std::size_t k = 0; k < 4; ++k) rows[6 * v + 2 + k] = tint.empty() ? 1.0f : tint[4 * v + k];
  }
  fixed->writeData(0, rows.size() * sizeof(float), rows.data(), true);
  std::memset(state_->lock(Ogre::HardwareBuffer::HBL_DISCARD), 0, kStateBytes * vertices);
  state_->unlock();
  data->vertexBufferBinding->setBinding(0, moving_);
  data->vertexBufferBinding->setBinding(1, fixed);
  data->vertexBufferBinding->setBinding(2, state_);
  int next = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::vector<std::uint32_t>& triangles = groups[g].triangles;
    if (triangles.empty()) continue;
    Ogre::SubMesh* part = mesh_->createSubMesh();
    part->useSharedVertices = true;
    auto indices = buffers.createIndexBuffer(Ogre::HardwareIndexBuffer::IT_32BIT, triangles.size(),
                                             Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY);
    indices->writeData(0, triangles.size() * 4, triangles.data(), true);
    part->indexData->indexBuffer = indices;
    part->indexData->indexCount = triangles.size();
    sub_entities_[g] = next++;
  }
  // Tissue reaches everywhere in the box: culling by bounds would save nothing and cost a pass over all
  // vertices.
  mesh_->_setBounds(Ogre::AxisAlignedBox(-1, -1, -1, 1, 1, 1));
  mesh_->_setBoundingSphereRadius(2);
  mesh_->load();
  entity_ = manager_->createEntity(uniqueName("entity"), mesh_->getName(), kOgreGroup);
  for (std::size_t g = 0; g < groups.size(); ++g) setMaterial(g, groups[g].material);
  entity_->setRenderQueueGroup(queue_);
  entity_->setCastShadows(false);
  entity_->setVisible(visible_);
  node_->attachObject(entity_);
}

void DynamicMesh::setMaterial(std::size_t group, const Ogre::MaterialPtr& material) {
  if (entity_ == nullptr || group >= sub_entities_.size() || sub_entities_[group] < 0) return;
  entity_->getSubEntity(static_cast<std::size_t>(sub_entities_[group]))->setMaterial(material);
}

void DynamicMesh::setState(const std::vector<std::uint8_t>& state) {
  if (!state_.get() || state.size() < kState * vertices_) return;
  float* out = static_cast<float*>(state_->lock(Ogre::HardwareBuffer::HBL_DISCARD));
  for (std::size_t i = 0; i < kState * vertices_; ++i)
    out[i] = static_cast<float>(state[i]) * (1.0f / 255.0f);
  state_->unlock();
}

void DynamicMesh::setVertices(const std::vector<float>& p, const std::vector<float>& n,
                              const std::vector<float>& t) {
  if (!moving_.get() || p.size() < 3 * vertices_ || n.size() < 3 * vertices_) return;
  float* out = static_cast<float*>(moving_->lock(Ogre::HardwareBuffer::HBL_DISCARD));
  const bool tangents = t.size() >= 3 * vertices_;
  for (std::size_t v = 0; v < vertices_; ++v, out += 9) {
    std::copy_n(&p[3 * v], 3, out);
    std::copy_n(&n[3 * v], 3, out + 3);
    if (tangents) {
      std::copy_n(&t[3 * v], 3, out + 6);
    } else {
      out[6] = out[7] = 0.0f;
      out[8] = 1.0f;
    }
  }
  moving_->unlock();
}

}  // namespace vest::displays

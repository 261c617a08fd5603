#include "dynamic_mesh.h"

#include <algorithm>

#include <OgreHardwareBufferManager.h>
#include <OgreMeshManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreSubMesh.h>

#include "ogre_assets.h"

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
  if (mesh_) {
    Ogre::MeshManager::getSingleton().remove(mesh_);
    mesh_.reset();
  }
  moving_.reset();
}

void DynamicMesh::setVisible(bool visible) {
  visible_ = visible;
  if (entity_ != nullptr) entity_->setVisible(visible);
}

void DynamicMesh::setShape(const std::vector<std::uint32_t>& triangles, const std::vector<float>& uv,
                           const std::vector<float>& tint, std::size_t vertices) {
  destroyEntity();
  vertices_ = vertices;
  if (vertices == 0 || triangles.empty()) return;
  mesh_ = Ogre::MeshManager::getSingleton().createManual(uniqueName("mesh"), kOgreGroup);
  Ogre::SubMesh* part = mesh_->createSubMesh();
  part->useSharedVertices = false;
  part->vertexData = new Ogre::VertexData();
  part->vertexData->vertexCount = vertices;
  Ogre::VertexDeclaration* declaration = part->vertexData->vertexDeclaration;
  declaration->addElement(0, 0, Ogre::VET_FLOAT3, Ogre::VES_POSITION);
  declaration->addElement(0, 12, Ogre::VET_FLOAT3, Ogre::VES_NORMAL);
  declaration->addElement(0, 24, Ogre::VET_FLOAT3, Ogre::VES_TEXTURE_COORDINATES, 1);
  declaration->addElement(1, 0, Ogre::VET_FLOAT2, Ogre::VES_TEXTURE_COORDINATES, 0);
  declaration->addElement(1, 8, Ogre::VET_FLOAT4, Ogre::VES_DIFFUSE);
  auto& buffers = Ogre::HardwareBufferManager::getSingleton();
  moving_ =
      buffers.createVertexBuffer(36, vertices, Ogre::HardwareBuffer::HBU_DYNAMIC_WRITE_ONLY_DISCARDABLE);
  auto fixed = buffers.createVertexBuffer(24, vertices, Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY);
  std::vector<float> rows(6 * vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    rows[6 * v] = uv.empty() ? 0.0f : uv[2 * v];
    rows[6 * v + 1] = uv.empty() ? 0.0f : uv[2 * v + 1];
    for (std::size_t k = 0; k < 4; ++k) rows[6 * v + 2 + k] = tint.empty() ? 1.0f : tint[4 * v + k];
  }
  fixed->writeData(0, rows.size() * sizeof(float), rows.data(), true);
  part->vertexData->vertexBufferBinding->setBinding(0, moving_);
  part->vertexData->vertexBufferBinding->setBinding(1, fixed);
  auto indices = buffers.createIndexBuffer(Ogre::HardwareIndexBuffer::IT_32BIT, triangles.size(),
                                           Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY);
  indices->writeData(0, triangles.size() * 4, triangles.data(), true);
  part->indexData->indexBuffer = indices;
  part->indexData->indexCount = triangles.size();
  // Tissue reaches everywhere in the box: culling by bounds would save nothing and cost a pass over all
  // vertices.
  mesh_->_setBounds(Ogre::AxisAlignedBox(-1, -1, -1, 1, 1, 1));
  mesh_->_setBoundingSphereRadius(2);
  mesh_->load();
  entity_ = manager_->createEntity(uniqueName("entity"), mesh_->getName(), kOgreGroup);
  entity_->setMaterial(material_);
  entity_->setRenderQueueGroup(queue_);
  entity_->setCastShadows(false);
  entity_->setVisible(visible_);
  node_->attachObject(entity_);
}

void DynamicMesh::setVertices(const std::vector<float>& p, const std::vector<float>& n,
                              const std::vector<float>& t) {
  if (!moving_ || p.size() < 3 * vertices_ || n.size() < 3 * vertices_) return;
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

#include "tissue_visual.h"

#include <algorithm>

#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>

#include "ogre_assets.h"
#include "vest_viz/mesh/occlusion.h"
#include "vest_viz/texture/organ_texture.h"

namespace vest::displays {

TissueVisual::TissueVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, int quality)
    : manager_(manager), node_(parent->createChildSceneNode()), quality_(quality) {}

TissueVisual::~TissueVisual() {
  for (Part& part : parts_) {
    part.mesh.reset();
    Ogre::MaterialManager::getSingleton().remove(part.material);
  }
  if (links_ != nullptr) manager_->destroyManualObject(links_);
  if (link_material_) Ogre::MaterialManager::getSingleton().remove(link_material_);
  node_->getParentSceneNode()->removeChild(node_);
  manager_->destroySceneNode(node_);
}

/// Closed skins need no back faces drawn: each edge is used once in each direction.
bool closed(const std::vector<std::uint32_t>& triangles) {
  std::vector<std::uint64_t> edges;
  edges.reserve(triangles.size());
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k)
      edges.push_back(static_cast<std::uint64_t>(triangles[t + k]) << 32 | triangles[t + (k + 1) % 3]);
  std::sort(edges.begin(), edges.end());
  for (std::uint64_t edge : edges)
    if (!std::binary_search(edges.begin(), edges.end(), edge << 32 | edge >> 32)) return false;
  return !edges.empty();
}

void TissueVisual::rebuild(const mesh::Store& store) {
  for (Part& part : parts_) {
    part.mesh.reset();
    Ogre::MaterialManager::getSingleton().remove(part.material);
  }
  parts_.clear();
  vertices_ = 0;
  const std::vector<std::vector<float>> occlusion = mesh::ambientOcclusion(store);
  const auto& objects = store.topology().objects;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const mesh::Object& o = objects[i];
    Part part;
    part.name = o.name;
    part.organ = o.organ;
    part.material = makeTissueMaterial(o.organ, quality_);
    if (warning_.empty()) warning_ = unsupported(part.material);
    Ogre::Pass* pass = part.material->getTechnique(0)->getPass(0);
    if (!o.rigid && closed(o.triangles)) pass->setCullingMode(Ogre::CULL_CLOCKWISE);
    part.parameters = pass->getFragmentProgramParameters();
    part.vertex_parameters = pass->getVertexProgramParameters();
    // Near and small things first: what they hide is not shaded.
    const std::uint8_t queue = o.rigid ? Ogre::RENDER_QUEUE_MAIN + 5 : Ogre::RENDER_QUEUE_MAIN;
    part.mesh = std::make_unique<DynamicMesh>(manager_, node_, part.material, queue);
    const std::size_t n = o.vertexCount();
    vertices_ += n;
    const texture::Style& style = texture::styleOf(o.organ);
    const double metres = mesh::metresPerTextureUnit(o, store.skin(i).positions.data());
    const float tiles = static_cast<float>(metres / style.tile);
    std::vector<float> uv(2 * n, 0.0f), tint(4 * n, 1.0f);
    if (!o.texture_coordinates.empty())
      for (std::size_t k = 0; k < 2 * n; ++k) uv[k] = tiles * o.texture_coordinates[k];
    for (std::size_t v = 0; v < n; ++v) {
      const float* p = &store.skin(i).positions[3 * v];
      const std::array<float, 3> c = texture::tintAt(p[0], p[1], p[2], style);
      for (std::size_t k = 0; k < 3; ++k) tint[4 * v + k] = c[k];
      tint[4 * v + 3] = occlusion[i].empty() ? 1.0f : occlusion[i][v];
    }
    part.mesh->setShape(o.triangles, uv, tint, n);
    parts_.push_back(std::move(part));
  }
  setAlpha(alpha_);
  applyVisibility();
}

void TissueVisual::update(const mesh::Store& store) {
  const bool fresh = store.shapeVersion() != shape_version_;
  if (fresh) {
    shape_version_ = store.shapeVersion();
    rebuild(store);
  }
  for (std::size_t i = 0; i < parts_.size(); ++i)
    if (fresh || store.moved(i))
      parts_[i].mesh->setVertices(store.skin(i).positions, store.skin(i).normals, store.skin(i).tangents);
  if (show_links_) drawLinks(store);
}

void TissueVisual::setLight(const Ogre::Vector4& light) {
  for (Part& part : parts_)
    if (part.vertex_parameters) part.vertex_parameters->setNamedConstant("light", light);
}

void TissueVisual::setAlpha(float alpha) {
  alpha_ = alpha;
  for (Part& part : parts_) {
    if (part.parameters) part.parameters->setNamedConstant("alpha", alpha);
    Ogre::Pass* pass = part.material->getTechnique(0)->getPass(0);
    pass->setSceneBlending(alpha < 0.999f ? Ogre::SBT_TRANSPARENT_ALPHA : Ogre::SBT_REPLACE);
    pass->setDepthWriteEnabled(alpha >= 0.999f);
  }
}

void TissueVisual::showSurface(bool show) {
  show_surface_ = show;
  applyVisibility();
}

void TissueVisual::showLinks(bool show) {
  show_links_ = show;
  if (links_ != nullptr) links_->setVisible(show);
}

void TissueVisual::setFilter(const std::set<std::string>& names) {
  filter_ = names;
  applyVisibility();
}

void TissueVisual::applyVisibility() {
  for (Part& part : parts_)
    part.mesh->setVisible(show_surface_ && (filter_.empty() || filter_.count(part.name) != 0 ||
                                            filter_.count(part.organ) != 0));
}

void TissueVisual::drawLinks(const mesh::Store& store) {
  if (links_ == nullptr) {
    link_material_ = Ogre::MaterialManager::getSingleton().create(uniqueName("links"), kOgreGroup);
    link_material_->setLightingEnabled(false);
    links_ = manager_->createManualObject(uniqueName("links"));
    links_->setDynamic(true);
    links_->setCastShadows(false);
    node_->attachObject(links_);
  }
  links_->clear();
  links_->begin(link_material_->getName(), Ogre::RenderOperation::OT_LINE_LIST, kOgreGroup);
  const auto& objects = store.topology().objects;
  std::size_t lines = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const mesh::Object& o = objects[i];
    if (!filter_.empty() && filter_.count(o.name) == 0 && filter_.count(o.organ) == 0) continue;
    for (std::size_t k = 0; 2 * k < o.link_knots.size(); ++k) {
      if (!o.link_alive.empty() && !o.link_alive[k]) continue;
      for (int end = 0; end < 2; ++end) {
        const float* p = store.knots(i) +
                         3 * static_cast<std::size_t>(o.link_knots[2 * k + static_cast<std::size_t>(end)]);
        links_->position(p[0], p[1], p[2]);
        links_->colour(0.1f, 0.85f, 0.75f);
      }
      ++lines;
    }
  }
  if (lines == 0) {  // an empty section is an error for OGRE
    links_->position(0, 0, 0);
    links_->position(0, 0, 0);
  }
  links_->end();
  links_->setVisible(show_links_);
}

}  // namespace vest::displays

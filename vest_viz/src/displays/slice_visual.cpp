#include "slice_visual.h"

#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>

#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {
namespace {

std::string borderName(const Ogre::MaterialPtr& face) {
  return face->getName() + "/border";
}

}  // namespace

SliceVisual::SliceVisual(Ogre::SceneManager* manager, Ogre::SceneNode* node)
    : manager_(manager), object_(manager->createManualObject(uniqueName("slice"))) {
  material_ = Ogre::MaterialManager::getSingleton().create(uniqueName("slice"), kOgreGroup);
  material_->setLightingEnabled(false);  // colours are read off the legend
  material_->setCullingMode(Ogre::CULL_NONE);
  const Ogre::MaterialPtr border = material_->clone(borderName(material_));
  border->getTechnique(0)->getPass(0)->setDepthBias(4.0f, 4.0f);  // lines lie in the face
  object_->setDynamic(true);
  object_->setCastShadows(false);
  node->attachObject(object_);
}

SliceVisual::~SliceVisual() {
  manager_->destroyManualObject(object_);
  Ogre::MaterialPtr border =
      Ogre::MaterialManager::getSingleton().getByName(borderName(material_), kOgreGroup);
  drop(border);
  drop(material_);
}

void SliceVisual::hide() {
  object_->setVisible(false);
}

void SliceVisual::show(const inspect::Slice& slice,
                       const std::function<inspect::Colour(std::size_t)>& colour) {
  object_->clear();
  const auto put = [&](const float* p, const inspect::Colour& c) {
    object_->position(p[0], p[1], p[2]);
    object_->colour(c[0], c[1], c[2]);
  };
  if (!slice.triangles.empty()) {
    object_->begin(material_->getName(), Ogre::RenderOperation::OT_TRIANGLE_LIST, kOgreGroup);
    for (std::size_t v = 0; v < slice.values.size(); ++v) put(&slice.positions[3 * v], colour(v));
    for (const std::uint32_t v : slice.triangles) object_->index(v);
    object_->end();
  }
  if (!slice.borders.empty()) {
    constexpr inspect::Colour kBorder{0.96f, 0.96f, 0.92f};
    object_->begin(borderName(material_), Ogre::RenderOperation::OT_LINE_LIST, kOgreGroup);
    for (std::size_t i = 0; i < slice.borders.size(); i += 3) put(&slice.borders[i], kBorder);
    object_->end();
  }
  object_->setVisible(true);
}

}  // namespace vest::displays

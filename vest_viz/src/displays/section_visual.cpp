#include "section_visual.h"

#include <OgreHardwarePixelBuffer.h>
#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>

#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {

SectionVisual::SectionVisual(Ogre::SceneManager* manager, Ogre::SceneNode* node)
    : manager_(manager), object_(manager->createManualObject(uniqueName("section"))) {
  material_ = cloneMaterial("vest_viz/Section");
  object_->setDynamic(true);
  object_->setCastShadows(false);
  node->attachObject(object_);
}

SectionVisual::~SectionVisual() {
  manager_->destroyManualObject(object_);
  drop(material_);
  drop(texture_);
}

void SectionVisual::hide() {
  object_->setVisible(false);
}

void SectionVisual::show(volume::Section& section) {
  if (section.width == 0) return hide();
  const auto wide = static_cast<Ogre::uint>(section.width), tall = static_cast<Ogre::uint>(section.height);
  if (!texture_.get() || texture_->getWidth() != wide || texture_->getHeight() != tall) {
    drop(texture_);
    texture_ = Ogre::TextureManager::getSingleton().createManual(
        uniqueName("section"), kOgreGroup, Ogre::TEX_TYPE_2D, wide, tall, 0, Ogre::PF_BYTE_RGBA,
        Ogre::TU_DYNAMIC_WRITE_ONLY);
    for (unsigned short t = 0; t < material_->getNumTechniques(); ++t)
      material_->getTechnique(t)->getPass(0)->getTextureUnitState("picture")->setTexture(texture_);
  }
  texture_->getBuffer()->blitFromMemory(
      Ogre::PixelBox(wide, tall, 1, Ogre::PF_BYTE_RGBA, section.rgba.data()));
  object_->clear();
  object_->begin(material_->getName(), Ogre::RenderOperation::OT_TRIANGLE_STRIP, kOgreGroup);
  for (int corner = 0; corner < 4; ++corner) {
    const int u = corner & 1, v = corner >> 1;
    const Eigen::Vector3f p =
        (section.corner + u * section.width * section.right + v * section.height * section.down)
            .cast<float>();
    object_->position(p.x(), p.y(), p.z());
    object_->textureCoord(static_cast<float>(u), static_cast<float>(v));
  }
  object_->end();
  object_->setVisible(true);
}

}  // namespace vest::displays

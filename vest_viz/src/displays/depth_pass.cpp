#include "depth_pass.h"

#include <OgreCamera.h>
#include <OgreHardwarePixelBuffer.h>
#include <OgreRenderTexture.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <OgreViewport.h>

#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {
namespace {
constexpr const char* kScheme = "vest_viz/depth";
}

DepthPass::DepthPass(Ogre::SceneManager* manager) : manager_(manager) {
  material_ = cloneMaterial("vest_viz/Depth");
  camera_ = manager->createCamera(uniqueName("depth"));
  manager->getRootSceneNode()->attachObject(camera_);
  Ogre::MaterialManager::getSingleton().addListener(this, kScheme);
}

DepthPass::~DepthPass() {
  Ogre::MaterialManager::getSingleton().removeListener(this, kScheme);
  release();
  manager_->destroyCamera(camera_);
  drop(material_);
}

void DepthPass::release() {
  if (target_ != nullptr) target_->removeAllViewports();
  target_ = nullptr;
  drop(texture_);
}

Ogre::Technique* DepthPass::handleSchemeNotFound(unsigned short, const Ogre::String&,
                                                 Ogre::Material* original, unsigned short,
                                                 const Ogre::Renderable*) {
  return material_->getTechnique(original->isTransparent() ? 1 : 0);
}

void DepthPass::draw(const Ogre::Camera& from, int width, int height, std::vector<float>* depth) {
  const auto wide = static_cast<Ogre::uint>(width), tall = static_cast<Ogre::uint>(height);
  if (!texture_.get() || texture_->getWidth() != wide || texture_->getHeight() != tall) {
    release();
    texture_ = Ogre::TextureManager::getSingleton().createManual(uniqueName("depth"), kOgreGroup,
                                                                 Ogre::TEX_TYPE_2D, wide, tall, 0,
                                                                 Ogre::PF_BYTE_RGBA, Ogre::TU_RENDERTARGET);
    target_ = texture_->getBuffer()->getRenderTarget();
    target_->setAutoUpdated(false);
    Ogre::Viewport* const viewport = target_->addViewport(camera_);
    viewport->setOverlaysEnabled(false);
    viewport->setShadowsEnabled(false);
    viewport->setSkiesEnabled(false);
    viewport->setMaterialScheme(kScheme);
    viewport->setBackgroundColour(Ogre::ColourValue::White);
  }
  camera_->setCustomViewMatrix(true, from.getViewMatrix());
  camera_->setCustomProjectionMatrix(true, from.getProjectionMatrix());
  target_->update();
  if (depth == nullptr) return;
  pixels_.resize(4 * static_cast<std::size_t>(wide) * tall);
  texture_->getBuffer()->blitToMemory(Ogre::PixelBox(wide, tall, 1, Ogre::PF_BYTE_RGBA, pixels_.data()));
  depth->resize(static_cast<std::size_t>(wide) * tall);
  for (std::size_t p = 0; p < depth->size(); ++p) {
    const std::uint8_t* const rgb = &pixels_[4 * p];
    const std::uint32_t z =
        static_cast<std::uint32_t>(rgb[0]) << 16 | static_cast<std::uint32_t>(rgb[1]) << 8 | rgb[2];
    (*depth)[p] = static_cast<float>(2.0 * z / 16777215.0 - 1.0);
  }
}

}  // namespace vest::displays

#pragma once

#include <string>
#include <vector>

#include <OgreMaterialManager.h>
#include <OgreTexture.h>

namespace Ogre {
class Camera;
class RenderTarget;
class SceneManager;
}  // namespace Ogre

namespace vest::displays {

/// Draws how far away each opaque thing of a scene is, for a volume that mixes with it.
class DepthPass : public Ogre::MaterialManager::Listener {
 public:
  explicit DepthPass(Ogre::SceneManager* manager);
  ~DepthPass() override;
  DepthPass(const DepthPass&) = delete;
  DepthPass& operator=(const DepthPass&) = delete;

  /// As `from` sees it. @param depth row by row from the top: z of the device, -1 … 1; 1: nothing is there.
  /// null: it stays in texture()
  void draw(const Ogre::Camera& from, int width, int height, std::vector<float>* depth);

  const Ogre::TexturePtr& texture() const { return texture_; }

  Ogre::Technique* handleSchemeNotFound(unsigned short, const Ogre::String&, Ogre::Material* original,
                                        unsigned short, const Ogre::Renderable*) override;

 private:
  void release();

  Ogre::SceneManager* manager_;
  Ogre::Camera* camera_;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
  Ogre::RenderTarget* target_ = nullptr;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace vest::displays

#pragma once

#include <OgreMaterial.h>
#include <OgreTexture.h>

#include "vest_viz/volume/section.h"

namespace Ogre {
class ManualObject;
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace vest::displays {

/// A slice of a volume as a picture that lies in the scene.
class SectionVisual {
 public:
  SectionVisual(Ogre::SceneManager* manager, Ogre::SceneNode* node);
  ~SectionVisual();
  SectionVisual(const SectionVisual&) = delete;
  SectionVisual& operator=(const SectionVisual&) = delete;

  void show(volume::Section& section);  ///< an empty one hides it
  void hide();

 private:
  Ogre::SceneManager* manager_;
  Ogre::ManualObject* object_;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
};

}  // namespace vest::displays

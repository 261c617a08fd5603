#pragma once

#include <functional>

#include <OgreMaterial.h>

#include "vest_viz/inspect/colour_map.h"
#include "vest_viz/inspect/slice.h"

namespace Ogre {
class ManualObject;
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace vest::displays {

/// Draws the face that a plane cuts, and the borders of skins in it.
class SliceVisual {
 public:
  SliceVisual(Ogre::SceneManager* manager, Ogre::SceneNode* node);
  ~SliceVisual();
  SliceVisual(const SliceVisual&) = delete;
  SliceVisual& operator=(const SliceVisual&) = delete;

  /// @param colour of a vertex of the face, by its index
  void show(const inspect::Slice& slice, const std::function<inspect::Colour(std::size_t)>& colour);
  void hide();

 private:
  Ogre::SceneManager* manager_;
  Ogre::ManualObject* object_;
  Ogre::MaterialPtr material_;
};

}  // namespace vest::displays

#pragma once

#include <OgreMaterial.h>
#include <OgrePass.h>
#include <OgrePrerequisites.h>
#include <OgreResource.h>
#include <OgreResourceManager.h>
#include <OgreTechnique.h>

/// What OGRE 1.9 (rviz of ROS Noetic) and OGRE 1.12 (Debian) say differently. Their pointers have get() in
/// common, and nothing that tells whether they are empty.
#define VEST_OGRE_BEFORE_1_12 (OGRE_VERSION < ((1 << 16) | (12 << 8)))

namespace vest::displays {

/// Removes what a pointer holds from its manager; the pointer is empty then.
template <class ResourcePtr>
void drop(ResourcePtr& pointer) {
  if (!pointer.get()) return;
  Ogre::ResourcePtr resource = pointer;
  pointer = ResourcePtr();
  resource->getCreator()->remove(resource);
}

/// `use` gets each pass of the first technique.
template <class Use>
void forEachPass(const Ogre::MaterialPtr& material, Use&& use) {
  Ogre::Technique* technique = material->getTechnique(0);
  for (unsigned short i = 0; i < technique->getNumPasses(); ++i) use(technique->getPass(i));
}

/// For elements of overlays and for rectangles on the screen.
#if VEST_OGRE_BEFORE_1_12
template <class Element>
auto useMaterial(Element* element, const Ogre::MaterialPtr& material)
    -> decltype(element->setMaterialName(material->getName())) {
  element->setMaterialName(material->getName());
}
template <class Element>
auto useMaterial(Element* element, const Ogre::MaterialPtr& material)
    -> decltype(element->setMaterial(material->getName())) {
  element->setMaterial(material->getName());
}
inline void setLineWidth(Ogre::Pass*, float) {}  // one pixel
#else
template <class Element>
void useMaterial(Element* element, const Ogre::MaterialPtr& material) {
  element->setMaterial(material);
}
inline void setLineWidth(Ogre::Pass* pass, float pixels) {
  pass->setLineWidth(pixels);
}
#endif

}  // namespace vest::displays

#pragma once

#include <map>
#include <string>

#include <OgreMaterial.h>
#include <OgreTexture.h>

namespace vest::displays {

constexpr const char* kOgreGroup = "vest_viz";

/// Registers ogre_media once per process. Throws std::runtime_error if the package is not found.
void loadOgreMedia();
/// A name that no other resource of this process has.
std::string uniqueName(const std::string& what);
/// Textures of an organ, kept for the life of the process. A plain colour at first; a thread bakes them.
struct OrganTextures {
  Ogre::TexturePtr albedo, relief;
  double tile = 0;  ///< m
};
const OrganTextures& organTextures(const std::string& organ, int quality);
/// Uploads what the thread has baked since the last call; for the thread that draws. True if nothing is
/// missing.
bool takeBakedTextures();
Ogre::TexturePtr microTexture();
double microTile();
/// A clone of vest_viz/Tissue (or of vest_viz/TissueState, which shows what happened to the tissue) with the
/// organ's textures.
Ogre::MaterialPtr makeTissueMaterial(const std::string& organ, int quality, bool with_state = false);
/// A clone of one of the materials of ogre_media/vest_viz.material, loaded. Throws std::runtime_error if it
/// is missing.
Ogre::MaterialPtr cloneMaterial(const std::string& name);
/// Turbulence in grey that tiles, for puffs of smoke.
Ogre::TexturePtr cloudTexture();
/// Empty, or why this machine cannot show the shaded technique.
std::string unsupported(const Ogre::MaterialPtr& material);
/// What is seen through is reached through: the picture in which rviz looks what lies under the mouse, where
/// other materials are black, leaves it out.
void letMouseThrough(const Ogre::MaterialPtr& material, bool through);

}  // namespace vest::displays

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
/// A clone of vest_viz/Tissue with the organ's textures.
Ogre::MaterialPtr makeTissueMaterial(const std::string& organ, int quality);
/// Empty, or why this machine cannot show the shaded technique.
std::string unsupported(const Ogre::MaterialPtr& material);

}  // namespace vest::displays

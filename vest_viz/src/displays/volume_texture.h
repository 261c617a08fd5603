#pragma once

#include <vector>

#include <OgreMaterial.h>
#include <OgreTexture.h>
#include <Eigen/Core>

#include "vest_viz/volume/ray_caster.h"

namespace vest::displays {

/// A volume as a 3-D texture, through which a fragment program casts the rays of volume::RayCaster.
class VolumeTexture {
 public:
  /// @throws std::runtime_error: this machine has no such textures or programs, or not of this size
  explicit VolumeTexture(const volume::RayCaster& caster);
  ~VolumeTexture();
  VolumeTexture(const VolumeTexture&) = delete;
  VolumeTexture& operator=(const VolumeTexture&) = delete;

  /// @param from_clip as volume::View's, to the brick's world
  /// @param depth of what is opaque, as DepthPass draws it
  void update(const volume::RayCaster& caster, const Eigen::Matrix4d& from_clip, const volume::Look& look,
              const Ogre::TexturePtr& depth);
  const Ogre::MaterialPtr& material() const { return material_; }

 private:
  void release();
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr values_, colours_;
};

}  // namespace vest::displays

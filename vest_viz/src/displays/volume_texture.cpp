#include "volume_texture.h"

#include <stdexcept>

#include <OgreHardwarePixelBuffer.h>
#include <OgreMatrix4.h>
#include <OgreRenderSystem.h>
#include <OgreRoot.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <Eigen/LU>

#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {
namespace {

Ogre::Matrix4 toOgre(const Eigen::Matrix4d& m) {
  Ogre::Matrix4 out;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) out[r][c] = static_cast<Ogre::Real>(m(r, c));
  return out;
}

Ogre::TextureUnitState* unit(const Ogre::MaterialPtr& material, const char* name) {
  return material->getTechnique(0)->getPass(0)->getTextureUnitState(name);
}

}  // namespace

VolumeTexture::VolumeTexture(const volume::RayCaster& caster) {
  const volume::Brick& brick = caster.brick();
  material_ = cloneMaterial("vest_viz/VolumeRays");
  std::string why = unsupported(material_);
  if (!Ogre::Root::getSingleton().getRenderSystem()->getCapabilities()->hasCapability(Ogre::RSC_TEXTURE_3D))
    why = "it has no 3-D textures";
  try {
    if (!why.empty()) throw std::runtime_error(why);
    values_ = Ogre::TextureManager::getSingleton().createManual(
        uniqueName("values"), kOgreGroup, Ogre::TEX_TYPE_3D, brick.size[0], brick.size[1], brick.size[2], 0,
        Ogre::PF_SHORT_GR, Ogre::TU_STATIC_WRITE_ONLY);
    if (values_->getWidth() != brick.size[0] || values_->getHeight() != brick.size[1] ||
        values_->getDepth() != brick.size[2] || values_->getFormat() != Ogre::PF_SHORT_GR)
      throw std::runtime_error("it has no 3-D textures of this size with 16 bits");
    std::vector<std::uint16_t> pairs;
    pairs.reserve(2 * brick.voxels());
    for (const std::int16_t number : brick.stored) {
      const bool is = number != volume::Brick::kNothing;
      pairs.push_back(static_cast<std::uint16_t>(is ? number + 32768 : 0));
      pairs.push_back(is ? 65535 : 0);
    }
    values_->getBuffer()->blitFromMemory(
        Ogre::PixelBox(brick.size[0], brick.size[1], brick.size[2], Ogre::PF_SHORT_GR, pairs.data()));
  } catch (const std::exception& error) {  // Ogre::Exception is one
    const std::string said = error.what();
    release();
    throw std::runtime_error("the graphics card cannot show this volume: " + said);
  }
  unit(material_, "values")->setTexture(values_);
}

VolumeTexture::~VolumeTexture() {
  release();
}

void VolumeTexture::release() {
  drop(material_);
  drop(values_);
  drop(colours_);
}

void VolumeTexture::update(const volume::RayCaster& caster, const Eigen::Matrix4d& from_clip,
                           const volume::Look& look, const Ogre::TexturePtr& depth) {
  const volume::RayCaster::Table table = caster.tableOf(look.step);
  const auto entries = static_cast<Ogre::uint>(table.colours.size());
  if (!colours_.get()) {
    colours_ = Ogre::TextureManager::getSingleton().createManual(
        uniqueName("colours"), kOgreGroup, Ogre::TEX_TYPE_2D, entries, 1, 0, Ogre::PF_FLOAT32_RGBA,
        Ogre::TU_DYNAMIC_WRITE_ONLY);
    unit(material_, "colours")->setTexture(colours_);
  }
  colours_->getBuffer()->blitFromMemory(Ogre::PixelBox(entries, 1, 1, Ogre::PF_FLOAT32_RGBA,
                                                       const_cast<Eigen::Vector4f*>(table.colours.data())));
  unit(material_, "depths")->setTexture(depth);
  const volume::Brick& brick = caster.brick();
  Eigen::Matrix4d to_world = Eigen::Matrix4d::Identity();
  to_world.topLeftCorner<3, 3>() = brick.axes;
  to_world.topRightCorner<3, 1>() = brick.origin;
  Ogre::Vector4 cut(0, 0, 0, 1);  // nothing
  if (!look.cuts.empty())
    cut = Ogre::Vector4(look.cuts[0].normal.x(), look.cuts[0].normal.y(), look.cuts[0].normal.z(),
                        look.cuts[0].offset);
  const auto parameters = material_->getTechnique(0)->getPass(0)->getFragmentProgramParameters();
  using Caster = volume::RayCaster;
  parameters->setNamedConstant("from_clip", toOgre(from_clip));
  parameters->setNamedConstant("to_grid", toOgre(to_world.inverse()));
  parameters->setNamedConstant("cut", cut);
  parameters->setNamedConstant(
      "size", Ogre::Vector4(static_cast<float>(brick.size[0]), static_cast<float>(brick.size[1]),
                            static_cast<float>(brick.size[2]), 0));
  parameters->setNamedConstant("steps", Ogre::Vector4(static_cast<float>(look.step), table.first, table.scale,
                                                      static_cast<float>(entries)));
  parameters->setNamedConstant("shading", Ogre::Vector4(look.shaded ? 1.0f : 0.0f, Caster::kAmbient,
                                                        Caster::kEdge, Caster::kLeastLight));
}

}  // namespace vest::displays

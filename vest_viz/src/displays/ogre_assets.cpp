#include "ogre_assets.h"

#include <atomic>
#include <stdexcept>

#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgreResourceGroupManager.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <OgreTextureUnitState.h>
#include <ros/package.h>

#include "vest_viz/texture/organ_texture.h"

namespace vest::displays {
namespace {

Ogre::TexturePtr upload(const std::string& name, int size, std::vector<std::uint8_t>& rgba) {
  Ogre::TexturePtr texture = Ogre::TextureManager::getSingleton().createManual(
      name, kOgreGroup, Ogre::TEX_TYPE_2D, static_cast<Ogre::uint>(size), static_cast<Ogre::uint>(size),
      Ogre::MIP_UNLIMITED, Ogre::PF_BYTE_RGBA, Ogre::TU_STATIC_WRITE_ONLY | Ogre::TU_AUTOMIPMAP);
  const Ogre::PixelBox box(static_cast<std::uint32_t>(size), static_cast<std::uint32_t>(size), 1,
                           Ogre::PF_BYTE_RGBA, rgba.data());
  texture->getBuffer()->blitFromMemory(box);
  return texture;
}

}  // namespace

void loadOgreMedia() {
  static bool loaded = false;
  if (loaded) return;
  const std::string path = ros::package::getPath("vest_viz");
  if (path.empty())
    throw std::runtime_error("package vest_viz is not on ROS_PACKAGE_PATH: its shaders cannot be found");
  auto& groups = Ogre::ResourceGroupManager::getSingleton();
  if (!groups.resourceGroupExists(kOgreGroup)) groups.createResourceGroup(kOgreGroup);
  groups.addResourceLocation(path + "/ogre_media", "FileSystem", kOgreGroup);
  groups.initialiseResourceGroup(kOgreGroup);
  loaded = true;
}

std::string uniqueName(const std::string& what) {
  static std::atomic<unsigned> count{0};
  return "vest_viz/" + what + "/" + std::to_string(count++);
}

const OrganTextures& organTextures(const std::string& organ, int quality) {
  static std::map<std::string, OrganTextures> cache;
  const texture::Style& style = texture::styleOf(organ);
  const int size = (style.tile > 0.06 ? 1024 : 512) >> (quality > 0 ? 0 : 1);
  OrganTextures& found = cache[style.organ + "/" + std::to_string(size)];
  if (!found.albedo) {
    texture::Baked baked = texture::bake(style, size, 17);
    found.albedo = upload(uniqueName("albedo"), size, baked.albedo);
    found.relief = upload(uniqueName("relief"), size, baked.relief);
    found.tile = baked.tile;
  }
  return found;
}

Ogre::TexturePtr microTexture() {
  static Ogre::TexturePtr texture;
  if (!texture) {
    texture::Baked baked = texture::bakeMicro(256, 5);
    texture = upload(uniqueName("micro"), 256, baked.relief);
  }
  return texture;
}

double microTile() {
  return 0.006;
}

Ogre::MaterialPtr makeTissueMaterial(const std::string& organ, int quality) {
  const OrganTextures& textures = organTextures(organ, quality);
  const texture::Style& style = texture::styleOf(organ);
  Ogre::MaterialPtr base = Ogre::MaterialManager::getSingleton().getByName("vest_viz/Tissue", kOgreGroup);
  if (!base) throw std::runtime_error("ogre_media/vest_viz.material of package vest_viz is missing");
  Ogre::MaterialPtr material = base->clone(uniqueName("material"), true, kOgreGroup);
  for (unsigned short i = 0; i < material->getNumTechniques(); ++i) {
    Ogre::Pass* pass = material->getTechnique(i)->getPass(0);
    pass->getTextureUnitState("albedo")->setTexture(textures.albedo);
    if (i > 0) continue;
    pass->getTextureUnitState("relief")->setTexture(textures.relief);
    pass->getTextureUnitState("micro")->setTexture(microTexture());
    pass->getFragmentProgramParameters()->setNamedConstant(
        "look",
        Ogre::Vector4(style.wet, style.translucence, static_cast<float>(style.tile / microTile()), 1.0f));
  }
  material->load();
  return material;
}

std::string unsupported(const Ogre::MaterialPtr& material) {
  material->load();
  if (material->getBestTechnique() != nullptr && material->getBestTechnique() == material->getTechnique(0))
    return {};
  return material->getUnsupportedTechniquesExplanation();
}

}  // namespace vest::displays

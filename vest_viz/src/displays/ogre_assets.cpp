#include "ogre_assets.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <stdexcept>

#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgreResourceGroupManager.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <OgreTextureUnitState.h>
#include <ros/package.h>
#include <opencv2/imgproc.hpp>

#include "vest_tissue/cache/block.h"
#include "vest_viz/texture/kept_texture.h"
#include "vest_viz/texture/noise.h"
#include "vest_viz/texture/organ_texture.h"

namespace vest::displays {
namespace {

void fill(const Ogre::TexturePtr& texture, int size, std::vector<std::uint8_t>& rgba) {
  const auto edge = static_cast<std::uint32_t>(size);
  texture->getBuffer()->blitFromMemory(Ogre::PixelBox(edge, edge, 1, Ogre::PF_BYTE_RGBA, rgba.data()));
}

Ogre::TexturePtr upload(const std::string& name, int size, std::vector<std::uint8_t>& rgba) {
  Ogre::TexturePtr texture = Ogre::TextureManager::getSingleton().createManual(
      name, kOgreGroup, Ogre::TEX_TYPE_2D, static_cast<Ogre::uint>(size), static_cast<Ogre::uint>(size),
      Ogre::MIP_UNLIMITED, Ogre::PF_BYTE_RGBA, Ogre::TU_STATIC_WRITE_ONLY | Ogre::TU_AUTOMIPMAP);
  fill(texture, size, rgba);
  return texture;
}

struct Entry {
  OrganTextures textures;
  const texture::Style* style = nullptr;
  int size = 0;                        ///< of its edge, in texels
  std::future<texture::Baked> baking;  ///< a sketch, then the whole
};
std::map<std::string, Entry>& cache() {
  static std::map<std::string, Entry> entries;
  return entries;
}

/// What is shown until something is baked: the organ's colour without pattern.
texture::Baked plain(const texture::Style& style, int size) {
  texture::Baked baked;
  baked.size = size;
  const std::size_t n = 4u * static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  baked.albedo.resize(n);
  baked.relief.resize(n);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t i = k % 4;
    baked.albedo[k] = i < 3 ? static_cast<std::uint8_t>(127.5f * (style.base[i] + style.second[i])) : 60;
    baked.relief[k] = i < 2 ? 128 : 200;
  }
  return baked;
}

std::future<texture::Baked> bakeBeside(const texture::Style& style, int size) {
  return std::async(std::launch::async, [&style, size] {
    static std::mutex one_at_a_time;  // the simulation needs the other processors
    const std::lock_guard<std::mutex> lock(one_at_a_time);
    return texture::bakeKept(style, size, 17, cache::defaultDirectory());
  });
}

/// Of the edge of a texture: a sixteenth of its time. A first session soon has its pattern, however busy the
/// machine.
constexpr int kSketch = 4;

void enlarge(int size, std::vector<std::uint8_t>* rgba) {
  const int edge = size / kSketch;
  std::vector<std::uint8_t> large(4u * static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  cv::Mat to(size, size, CV_8UC4, large.data());
  cv::resize(cv::Mat(edge, edge, CV_8UC4, rgba->data()), to, to.size());
  rgba->swap(large);
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
  const texture::Style& style = texture::styleOf(organ);
  const bool small = style.organ.rfind("cut_", 0) == 0;
  const int size = (style.tile > 0.06 ? 1024 : small ? 256 : 512) >> (quality > 0 ? 0 : 1);
  Entry& entry = cache()[style.organ + "/" + std::to_string(size)];
  if (!entry.textures.albedo.get()) {
    texture::Baked baked = plain(style, size);
    entry.textures.albedo = upload(uniqueName("albedo"), size, baked.albedo);
    entry.textures.relief = upload(uniqueName("relief"), size, baked.relief);
    entry.textures.tile = style.tile;
    entry.style = &style;
    entry.size = size;
    entry.baking = bakeBeside(style, size / kSketch);
  }
  return entry.textures;
}

bool takeBakedTextures() {
  bool all = true;
  for (auto& [name, entry] : cache()) {
    if (!entry.baking.valid()) continue;
    if (entry.baking.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
      all = false;
      continue;
    }
    texture::Baked baked = entry.baking.get();
    if (baked.size < entry.size) {
      enlarge(entry.size, &baked.albedo);
      enlarge(entry.size, &baked.relief);
      baked.size = entry.size;
      entry.baking = bakeBeside(*entry.style, entry.size);
      all = false;
    }
    fill(entry.textures.albedo, baked.size, baked.albedo);
    fill(entry.textures.relief, baked.size, baked.relief);
  }
  return all;
}

Ogre::TexturePtr microTexture() {
  static Ogre::TexturePtr texture;
  if (!texture.get()) {
    texture::Baked baked = texture::bakeMicro(256, 5);
    texture = upload(uniqueName("micro"), 256, baked.relief);
  }
  return texture;
}

double microTile() {
  return 0.006;
}

Ogre::TexturePtr cloudTexture() {
  static Ogre::TexturePtr texture;
  if (texture.get()) return texture;
  constexpr int kSize = 128;
  std::vector<std::uint8_t> rgba(4u * kSize * kSize, 255);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float u = (x + 0.5f) / kSize, v = (y + 0.5f) / kSize;
      const float value = 0.5f + 0.75f * texture::periodicFbm(u, v, 3, 3, 5, 71);
      for (int k = 0; k < 3; ++k)
        rgba[4u * (static_cast<std::size_t>(y) * kSize + x) + k] =
            static_cast<std::uint8_t>(255 * std::clamp(value, 0.0f, 1.0f));
    }
  texture = upload(uniqueName("cloud"), kSize, rgba);
  return texture;
}

Ogre::MaterialPtr cloneMaterial(const std::string& name) {
  Ogre::MaterialPtr base = Ogre::MaterialManager::getSingleton().getByName(name, kOgreGroup);
  if (!base.get()) throw std::runtime_error("ogre_media/vest_viz.material of package vest_viz lacks " + name);
  Ogre::MaterialPtr material = base->clone(uniqueName("material"), true, kOgreGroup);
  material->load();
  // A program that this machine cannot compile has no constants: setting them must not end the drawing, which
  // goes on with the plain technique.
  for (unsigned short i = 0; i < material->getNumTechniques(); ++i) {
    Ogre::Pass* pass = material->getTechnique(i)->getPass(0);
    if (pass->hasVertexProgram()) pass->getVertexProgramParameters()->setIgnoreMissingParams(true);
    if (pass->hasFragmentProgram()) pass->getFragmentProgramParameters()->setIgnoreMissingParams(true);
  }
  return material;
}

Ogre::MaterialPtr makeTissueMaterial(const std::string& organ, int quality, bool with_state) {
  const OrganTextures& textures = organTextures(organ, quality);
  const texture::Style& style = texture::styleOf(organ);
  Ogre::MaterialPtr material = cloneMaterial(with_state ? "vest_viz/TissueState" : "vest_viz/Tissue");
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
  const std::string why = material->getUnsupportedTechniquesExplanation();
  // A clone does not remember why.
  return why.empty() ? material->getName() + ": this machine cannot run its shaders, it is drawn plain" : why;
}

void letMouseThrough(const Ogre::MaterialPtr& material, bool through) {
  const char* const kScheme = "Pick";  // rviz/selection/selection_manager.cpp
  const unsigned short last = static_cast<unsigned short>(material->getNumTechniques() - 1);
  const bool is = material->getTechnique(last)->getSchemeName() == kScheme;
  if (is == through) return;
  if (is) return material->removeTechnique(last);
  Ogre::Technique* const technique = material->createTechnique();
  technique->setSchemeName(kScheme);
  Ogre::Pass* const pass = technique->createPass();
  pass->setColourWriteEnabled(false);
  pass->setDepthWriteEnabled(false);
}

}  // namespace vest::displays

#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include <OgreVector.h>

#include "dynamic_mesh.h"
#include "vest_viz/mesh/store.h"

namespace Ogre {
class ManualObject;
}

namespace vest::displays {

/// Draws what a mesh::Store holds: one DynamicMesh per object, and the wire net of its living links on
/// demand.
class TissueVisual {
 public:
  TissueVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, int quality);
  ~TissueVisual();

  /// Uploads what changed since the last call; call after store.rebuildSkins(), in update(), never in a
  /// callback.
  void update(const mesh::Store& store);
  /// @param light view space position in m and intensity; goes to every object's shader
  void setLight(const Ogre::Vector4& light);
  void setAlpha(float alpha);
  void showSurface(bool show);
  void showLinks(bool show);
  /// Only objects whose name or organ is in the set; an empty set shows all.
  void setFilter(const std::set<std::string>& names);
  /// Empty, or why shaders are not supported.
  const std::string& warning() const { return warning_; }
  std::size_t vertexCount() const { return vertices_; }

 private:
  struct Part {
    std::unique_ptr<DynamicMesh> mesh;
    Ogre::MaterialPtr material;
    /// Of fragment and vertex program; null in the fall-back technique.
    Ogre::GpuProgramParametersSharedPtr parameters, vertex_parameters;
    std::string name, organ;
  };
  void rebuild(const mesh::Store& store);
  void drawLinks(const mesh::Store& store);
  void applyVisibility();

  Ogre::SceneManager* manager_;
  Ogre::SceneNode* node_;
  int quality_;
  std::vector<Part> parts_;
  std::uint64_t shape_version_ = 0;
  std::size_t vertices_ = 0;
  Ogre::ManualObject* links_ = nullptr;
  Ogre::MaterialPtr link_material_;
  bool show_surface_ = true, show_links_ = false;
  float alpha_ = 1.0f;
  std::set<std::string> filter_;
  std::string warning_;
};

}  // namespace vest::displays

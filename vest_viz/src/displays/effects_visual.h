#pragma once

#include <memory>
#include <string>
#include <vector>

#include <OgreMaterial.h>
#include <vest_msgs/FluidState.h>
#include <vest_msgs/SmokeState.h>
#include <vest_msgs/SutureStates.h>
#include <vest_msgs/TissueAttachments.h>
#include <Eigen/Geometry>

#include "dynamic_mesh.h"
#include "ogre_vector.h"
#include "vest_viz/effects/drops.h"
#include "vest_viz/effects/shapes.h"

namespace vest::displays {

/// Clips, threads, needles, slings, drops, pools and puffs of smoke in a scene, from their messages. What is
/// not finite or does not fit is left out and counted.
class EffectsVisual {
 public:
  EffectsVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, bool depth_in_alpha);
  ~EffectsVisual();
  EffectsVisual(const EffectsVisual&) = delete;

  void setAttachments(const vest_msgs::TissueAttachments& attachments);
  void setSutures(const vest_msgs::SutureStates& sutures);
  /// Lines of an exercise on tissue.
  void setTargets(const instrument::TriangleMesh& lines);
  /// @param fluid null: none. Pools and films are built where it is another than before
  /// @param eye m, camera in world: drops and puffs face it
  void setFluid(const vest_msgs::FluidState::ConstPtr& fluid, const Eigen::Vector3d& eye);
  void setSmoke(const vest_msgs::SmokeState& smoke, const Eigen::Vector3d& eye, bool billboards);
  void setLight(const Ogre::Vector4& light);
  void setVisible(bool visible);
  void clear();
  const std::string& warning() const { return warning_; }

  /// What ground truth needs: metal and threads, and pools, as drawn last.
  const instrument::TriangleMesh& metal() const { return metal_mesh_; }
  const instrument::TriangleMesh& threads() const { return thread_mesh_; }
  const std::vector<effects::Pool>& pools() const { return pools_; }
  /// Drops as they were drawn last (facing the camera).
  const effects::Quads& drops() const { return drops_; }

 private:
  struct Surface {
    Ogre::MaterialPtr material;
    std::unique_ptr<DynamicMesh> mesh;
    std::size_t capacity = 0;  ///< quads
    std::vector<std::uint32_t> triangles;
  };
  void make(Surface* surface, const char* material, std::uint8_t queue);
  void show(Surface* surface, const instrument::TriangleMesh& mesh);
  void show(Surface* surface, effects::Quads* quads);
  void rebuildMetal();
  void showPools(const vest_msgs::FluidState& fluid);
  void showFilm(const vest_msgs::FluidFilm& film, const Ogre::Vector4& moment);

  Ogre::SceneManager* manager_;
  Ogre::SceneNode* node_;
  bool depth_in_alpha_, visible_ = true;
  Surface metal_, thread_, target_, film_, drop_, puff_;
  std::vector<Surface> pool_;
  instrument::TriangleMesh clips_mesh_, needles_mesh_, metal_mesh_, thread_mesh_;
  std::vector<effects::Pool> pools_;
  vest_msgs::FluidState::ConstPtr fluid_;  ///< whose pools and films are shown
  effects::Quads drops_, puffs_;
  std::string warning_;
};

}  // namespace vest::displays

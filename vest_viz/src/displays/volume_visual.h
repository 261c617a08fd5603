#pragma once

#include <atomic>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include <OgreMaterial.h>
#include <OgreMatrix4.h>
#include <OgreRenderTargetListener.h>
#include <OgreTexture.h>
#include <Eigen/Geometry>

#include "depth_pass.h"
#include "vest_viz/volume/ray_caster.h"
#include "volume_texture.h"
#include "worker.h"

namespace Ogre {
class Camera;
class Rectangle2D;
class RenderTarget;
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace vest::displays {

/// A volume in a window, mixed with what is opaque there. While anything moves its picture is coarse and of
/// this very frame; at rest a fine one follows from a thread of its own. Or the graphics card casts the rays.
class VolumeVisual : public Ogre::RenderTargetListener {
 public:
  VolumeVisual(Ogre::SceneManager* manager, Ogre::RenderTarget* window);
  ~VolumeVisual() override;
  VolumeVisual(const VolumeVisual&) = delete;
  VolumeVisual& operator=(const VolumeVisual&) = delete;

  void setCamera(const Ogre::Camera* camera) { camera_ = camera; }  ///< of the window; null: nothing
  void setBrick(std::shared_ptr<const volume::Brick> brick);        ///< null: nothing
  void setTable(const volume::TransferTable& table);
  void setLook(const std::vector<inspect::Plane>& cuts, bool shaded);
  void setPose(const Eigen::Isometry3d& frame);  ///< of the brick's world in the scene
  void setVisible(bool visible);
  /// By a 3-D texture on the graphics card, from the next picture on.
  void setOnCard(bool on_card);
  /// Why the graphics card does not do what it was asked for; empty: it does, or was not asked.
  const std::string& refusal() const { return refusal_; }

  void preRenderTargetUpdate(const Ogre::RenderTargetEvent&) override;
  void postRenderTargetUpdate(const Ogre::RenderTargetEvent&) override;

 private:
  struct Picture {
    int width = 0, height = 0;
    std::vector<float> depth;
    std::vector<std::uint8_t> rgba;
    bool whole = false;
  };
  void changed();
  void stop();
  volume::View viewOf(const Picture& picture) const;
  bool drawOnCard(const Eigen::Matrix4d& clip, double now);
  void drawCoarse();
  void startFine(int width, int height);
  void show(Picture& picture);

  Ogre::SceneManager* manager_;
  Ogre::RenderTarget* window_;
  const Ogre::Camera* camera_ = nullptr;
  Ogre::Rectangle2D* quad_ = nullptr;
  Ogre::SceneNode* node_ = nullptr;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
  DepthPass depth_;
  std::unique_ptr<VolumeTexture> card_;
  bool on_card_ = false;
  std::string refusal_;
  solver::Pool pool_;
  std::unique_ptr<volume::RayCaster> caster_;
  volume::Look look_;
  Eigen::Isometry3d frame_ = Eigen::Isometry3d::Identity();
  Eigen::Matrix4d clip_ = Eigen::Matrix4d::Zero();  ///< camera of the last picture
  Picture coarse_;
  int divisor_ = 4;  ///< of the window's pixels, for the coarse picture
  bool visible_ = true, stale_ = true, fine_ = false;
  double since_change_ = 0, looked_ = 0;  ///< s, steady
  std::atomic<bool> stop_{false};
  std::future<std::unique_ptr<Picture>> job_;
  Worker worker_;  ///< last: it uses the above
};

}  // namespace vest::displays

#pragma once

#include <map>
#include <memory>
#include <string>

#include <OgreTexture.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/TissueAttachments.h>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "effects_visual.h"
#include "instrument_visual.h"
#include "tissue_visual.h"
#include "vest_viz/camera/model.h"

namespace Ogre {
class Camera;
class ManualObject;
class RenderTexture;
}  // namespace Ogre

namespace vest::displays {

/// The body as the endoscope sees it: a scene manager of its own, so that nothing of rviz's view shows,
/// rendered into a texture and read back.
class EndoscopeScene {
 public:
  explicit EndoscopeScene(int quality);
  ~EndoscopeScene();
  EndoscopeScene(const EndoscopeScene&) = delete;

  /// @param source pinhole to render; @param circle radius of what is seen over the half width
  /// @param resolution pixels that are rendered per pixel of the picture, along an edge
  void setCamera(const camera::Intrinsics& source, double circle, double resolution);
  /// Call it after updateInstruments() and setHeld(): what jaws hold lies between them.
  void updateTissue(const mesh::Store& store);
  void setHeld(const vest_msgs::TissueAttachments& attachments);
  /// Skin of an object as it is drawn; x y z per vertex, m, in world.
  const std::vector<float>& drawnSkin(const mesh::Store& store, std::size_t object) const {
    return tissue_->drawnSkin(store, object);
  }
  /// False while updateTissue() would still find fewer triangles to draw.
  bool settled() const { return tissue_->settled(); }
  void updateInstruments(const vest_msgs::InstrumentStates& states);
  /// What the instruments' swabs hold: call it after updateInstruments().
  void setSwabs(const vest_msgs::FluidState& fluid);
  EffectsVisual& effects() { return *effects_; }
  const std::map<std::string, std::unique_ptr<InstrumentVisual>>& instruments() const { return instruments_; }
  /// Optical frame (z forward, x right, y down) in world.
  void setPose(const Eigen::Isometry3d& X_WO);
  /// @param gain of the camera control unit, 1 at the start
  void setGain(double gain) { gain_ = gain; }
  /// m: how far the cavity's wall has sunk (GasState); the next updateTissue() draws it so.
  void setSunk(double metres) { sunk_ = metres; }
  /// s, of the session: what flows is drawn as it is then.
  void setMoment(double seconds) { moment_ = seconds; }
  /// Intensity of the light times exposure, m2, as the shaders get it.
  double light() const;

  struct Timing {
    double draw = 0, read = 0;  ///< s
  };
  /// Renders and reads back. @param rgba CV_8UC4 of the source's size
  Timing render(cv::Mat* rgba);
  std::string warning() const;
  /// Whether the last picture was drawn with all textures baked.
  bool complete() const { return complete_; }

 private:
  void buildStop(double circle);
  TissueVisual::Shafts shafts() const;
  static TissueVisual::Shadows shadowsOf(const TissueVisual::Shafts& shafts);

  Ogre::SceneManager* manager_;
  Ogre::Camera* camera_;
  Ogre::SceneNode* camera_node_;
  Ogre::TexturePtr target_texture_;
  Ogre::RenderTexture* target_ = nullptr;
  Ogre::ManualObject* stop_ = nullptr;
  std::unique_ptr<TissueVisual> tissue_;
  std::unique_ptr<EffectsVisual> effects_;
  std::map<std::string, std::unique_ptr<InstrumentVisual>> instruments_;
  std::map<std::string, std::string> held_;  ///< object by the instrument that holds it
  camera::Intrinsics source_;
  Eigen::Isometry3d X_WO_ = Eigen::Isometry3d::Identity();
  double gain_ = 1.0;
  double moment_ = 0, sunk_ = 0;
  bool complete_ = false;
};

}  // namespace vest::displays

#pragma once

#include <memory>
#include <string>

#include <vest_msgs/FluidState.h>
#include <vest_msgs/GasState.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/LensState.h>
#include <vest_msgs/SmokeState.h>
#include <vest_msgs/SutureStates.h>
#include <vest_msgs/TissueAttachments.h>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "endoscope_scene.h"
#include "targets.h"
#include "vest_viz/picture/finish.h"
#include "vest_viz/smoke/veil.h"

namespace vest::displays {

/// From messages to the finished picture of the endoscope: scene, camera, smoke, lens, exposure. The display,
/// vest_render and the benchmark share it. Messages are put aside by the setters and worked on in render()
/// and finish(). A live view lets a worker finish a picture while it renders the next: between start of a
/// finish() and its end the setters, setCamera() excepted, and render() may be called, nothing else.
class EndoscopePipeline {
 public:
  /// How smoke is shown: by its density field, by billboards, or both.
  enum class Smoke { Off = 0, Field = 1, Billboards = 2, Both = 3 };

  /// @param quality 0 simple, 1 standard, 2 fine
  explicit EndoscopePipeline(int quality) : scene_(quality) {}

  /// @param circle radius of the round picture over half its height; @param resolution rendered pixels per
  /// pixel of the picture along an edge
  void setCamera(const camera::Intrinsics& camera, double circle, double resolution);
  void setLook(const picture::CameraLook& look);
  void setSmokeMethod(Smoke method) { method_ = method; }
  /// Exposure that stays as it is, for calibration and comparisons; 0: automatic.
  void setFixedGain(double gain) { fixed_gain_ = gain; }

  void setInstruments(const vest_msgs::InstrumentStates& states) { scene_.updateInstruments(states); }
  void setTissue(const mesh::Store& store) {
    scene_.updateTissue(store);
    scene_.effects().setTargets(targets_.mesh(store));
  }
  /// The same, and waits for the workers: textures, openness and triangles are final. For pictures that are
  /// kept; a live view goes on meanwhile and calls setTissue() until scene().settled().
  void settle(const mesh::Store& store);
  void setAttachments(const vest_msgs::TissueAttachments::ConstPtr& m) {
    scene_.effects().setAttachments(*m);
    scene_.setHeld(*m);
  }
  void setSutures(const vest_msgs::SutureStates::ConstPtr& m) { scene_.effects().setSutures(*m); }
  /// Shown with the next setTissue().
  void setTargets(const visualization_msgs::MarkerArray::ConstPtr& m) { targets_.set(*m); }
  void setFluid(const vest_msgs::FluidState::ConstPtr& m) { fluid_ = m; }
  void setSmoke(const vest_msgs::SmokeState::ConstPtr& m);
  void setLens(const vest_msgs::LensState::ConstPtr& m);
  void setGas(const vest_msgs::GasState::ConstPtr& m);
  void clear();

  struct Timing {
    double prepare = 0, draw = 0, read = 0, finish = 0;  ///< s
  };
  /// Draws the scene and reads it back. @param X_WO optical frame in world; @param time s, of the simulation,
  /// moves the smoke's pattern; @param dt s since the last picture, for the exposure
  Timing render(const Eigen::Isometry3d& X_WO, double time, double dt);
  /// Makes the last rendering, and the smoke and lens of now, what finish() works on. No finish() may run.
  void handOver();
  /// Smoke, lens, camera, exposure of what was handed over; by one thread at a time.
  /// @param out CV_8UC3, RGB; @return s
  double finish(cv::Mat* out);
  /// All of it, one after the other.
  Timing draw(const Eigen::Isometry3d& X_WO, double time, double dt, cv::Mat* out);

  EndoscopeScene& scene() { return scene_; }
  const picture::Finisher& finisher() const { return *finisher_; }
  const camera::Intrinsics& camera() const { return camera_; }
  /// Grows with each setCamera().
  std::uint64_t cameraVersion() const { return camera_version_; }
  bool ready() const { return finisher_ != nullptr; }

 private:
  EndoscopeScene scene_;
  Targets targets_;
  camera::Intrinsics camera_;
  std::uint64_t camera_version_ = 0;
  std::unique_ptr<picture::Finisher> finisher_;
  picture::AutoExposure exposure_;
  picture::CameraLook look_;
  picture::Lens lens_;
  smoke::Veil veil_;
  smoke::Field smoke_field_;
  Smoke method_ = Smoke::Field;
  double fixed_gain_ = 0;
  vest_msgs::FluidState::ConstPtr fluid_;
  vest_msgs::SmokeState::ConstPtr smoke_;
  bool lens_changed_ = false, look_changed_ = false;
  double gain_ = 1;  ///< of the picture handed over last
  /// What finish() works on.
  struct Rendered {
    cv::Mat rgba;
    smoke::Field smoke;  ///< where it shows
    bool smoky = false;
    Eigen::Isometry3d X_WO = Eigen::Isometry3d::Identity();
    double time = 0, dt = 0, light = 0, gain = 1;
  } rendered_, handed_over_;
  cv::Mat veil_picture_;
};

}  // namespace vest::displays

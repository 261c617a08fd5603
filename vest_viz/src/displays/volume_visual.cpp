#include "volume_visual.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include <OgreCamera.h>
#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgreRectangle2D.h>
#include <OgreRenderTarget.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <Eigen/LU>

#include "ogre_assets.h"
#include "ogre_versions.h"
#include "steady_seconds.h"

namespace vest::displays {
namespace {

constexpr double kRest = 0.25;       // s without a change before the fine picture begins (tuned)
constexpr double kLookAround = 0.1;  // s: how often at rest it is seen whether surfaces moved (tuned)
constexpr double kSlow = 0.12, kFast = 0.03;  // s of a coarse picture: pixels become larger, smaller
constexpr int kFinest = 2, kCoarsest = 8;     // pixels of the window along a pixel of the coarse picture

int threads() {
  return static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 16u));
}

Eigen::Matrix4d toEigen(const Ogre::Matrix4& m) {
  Eigen::Matrix4d e;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) e(r, c) = static_cast<double>(m[r][c]);
  return e;
}

}  // namespace

VolumeVisual::VolumeVisual(Ogre::SceneManager* manager, Ogre::RenderTarget* window)
    : manager_(manager), window_(window), depth_(manager), pool_(threads()) {
  material_ = cloneMaterial("vest_viz/Volume");
  quad_ = new Ogre::Rectangle2D(true);
  quad_->setCorners(-1, 1, 1, -1);
  useMaterial(quad_, material_);
  quad_->setRenderQueueGroup(Ogre::RENDER_QUEUE_OVERLAY - 1);
  quad_->setCastShadows(false);
  Ogre::AxisAlignedBox everywhere;
  everywhere.setInfinite();
  quad_->setBoundingBox(everywhere);
  quad_->setVisible(false);  // other cameras of this scene do not see it
  node_ = manager->getRootSceneNode()->createChildSceneNode();
  node_->attachObject(quad_);
  window_->addListener(this);
}

VolumeVisual::~VolumeVisual() {
  stop();
  window_->removeListener(this);
  node_->detachAllObjects();
  delete quad_;
  manager_->destroySceneNode(node_);
  drop(material_);
  drop(texture_);
}

void VolumeVisual::stop() {
  if (!job_.valid()) return;
  stop_ = true;
  job_.wait();
  job_ = {};
  stop_ = false;
}

void VolumeVisual::changed() {
  stop();
  stale_ = true;
}

void VolumeVisual::setBrick(std::shared_ptr<const volume::Brick> brick) {
  changed();
  card_.reset();
  refusal_.clear();
  caster_ = brick ? std::make_unique<volume::RayCaster>(std::move(brick)) : nullptr;
}

void VolumeVisual::setTable(const volume::TransferTable& table) {
  changed();
  if (caster_) caster_->setTable(table);
}

void VolumeVisual::setLook(const std::vector<inspect::Plane>& cuts, bool shaded) {
  changed();
  look_.cuts = cuts;
  look_.shaded = shaded;
}

void VolumeVisual::setPose(const Eigen::Isometry3d& frame) {
  if (frame.isApprox(frame_, 1e-9)) return;
  changed();
  frame_ = frame;
}

void VolumeVisual::setVisible(bool visible) {
  if (visible == visible_) return;
  changed();
  visible_ = visible;
}

void VolumeVisual::setOnCard(bool on_card) {
  if (on_card == on_card_) return;
  changed();
  on_card_ = on_card;
  card_.reset();
  refusal_.clear();
}

volume::View VolumeVisual::viewOf(const Picture& picture) const {
  return {picture.width, picture.height, frame_.inverse().matrix() * clip_.inverse(), picture.depth.data()};
}

bool VolumeVisual::drawOnCard(const Eigen::Matrix4d& clip, double now) {
  if (!refusal_.empty()) return false;
  try {
    if (!card_) card_ = std::make_unique<VolumeTexture>(*caster_);
  } catch (const std::exception& error) {
    refusal_ = error.what();
    return false;
  }
  if (stale_ || clip != clip_) since_change_ = now;
  stale_ = false;
  clip_ = clip;
  const bool moves = now - since_change_ < kRest;
  depth_.draw(*camera_, static_cast<int>(window_->getWidth()), static_cast<int>(window_->getHeight()),
              nullptr);
  volume::Look look = look_;
  look.step = (moves ? 1.5 : 0.5) * caster_->brick().axes.colwise().norm().minCoeff();
  card_->update(*caster_, frame_.inverse().matrix() * clip.inverse(), look, depth_.texture());
  useMaterial(quad_, card_->material());
  quad_->setVisible(true);
  return true;
}

void VolumeVisual::drawCoarse() {
  const double begin = seconds();
  const double voxel = caster_->brick().axes.colwise().norm().minCoeff();
  volume::Look look = look_;
  look.step = 1.5 * voxel;
  caster_->cast(viewOf(coarse_), look, pool_, &coarse_.rgba);
  show(coarse_);
  fine_ = false;
  const double took = seconds() - begin;
  if (took > kSlow) divisor_ = std::min(divisor_ + 1, kCoarsest);
  if (took < kFast) divisor_ = std::max(divisor_ - 1, kFinest);
}

void VolumeVisual::startFine(int width, int height) {
  auto picture = std::make_shared<Picture>();
  picture->width = width, picture->height = height;
  depth_.draw(*camera_, width, height, &picture->depth);
  volume::Look look = look_;
  look.step = 0.5 * caster_->brick().axes.colwise().norm().minCoeff();
  job_ = worker_.start([this, picture, look, view = viewOf(*picture)] {
    picture->whole = caster_->cast(view, look, pool_, &picture->rgba, &stop_);
    return std::make_unique<Picture>(std::move(*picture));
  });
}

void VolumeVisual::show(Picture& picture) {
  const auto wide = static_cast<Ogre::uint>(picture.width), tall = static_cast<Ogre::uint>(picture.height);
  if (!texture_.get() || texture_->getWidth() != wide || texture_->getHeight() != tall) {
    drop(texture_);
    texture_ = Ogre::TextureManager::getSingleton().createManual(
        uniqueName("volume"), kOgreGroup, Ogre::TEX_TYPE_2D, wide, tall, 0, Ogre::PF_BYTE_RGBA,
        Ogre::TU_DYNAMIC_WRITE_ONLY);
    material_->getTechnique(0)->getPass(0)->getTextureUnitState("picture")->setTexture(texture_);
  }
  texture_->getBuffer()->blitFromMemory(
      Ogre::PixelBox(wide, tall, 1, Ogre::PF_BYTE_RGBA, picture.rgba.data()));
}

void VolumeVisual::preRenderTargetUpdate(const Ogre::RenderTargetEvent&) {
  const int width = static_cast<int>(window_->getWidth()), height = static_cast<int>(window_->getHeight());
  if (!visible_ || !caster_ || camera_ == nullptr || width < 8 || height < 8) return;
  const Eigen::Matrix4d clip = toEigen(camera_->getProjectionMatrix()) * toEigen(camera_->getViewMatrix());
  const double now = seconds();
  if (on_card_ && drawOnCard(clip, now)) return;
  bool moved = stale_ || clip != clip_;
  if (moved || now - looked_ > kLookAround) {
    if (moved) coarse_.width = width / divisor_, coarse_.height = height / divisor_;
    std::vector<float> before = std::move(coarse_.depth);
    depth_.draw(*camera_, coarse_.width, coarse_.height, &coarse_.depth);
    moved = moved || before != coarse_.depth;
    looked_ = now;
  }
  if (moved) {
    stop();
    clip_ = clip;
    stale_ = false;
    since_change_ = now;
    drawCoarse();
  } else if (job_.valid()) {
    if (job_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      const std::unique_ptr<Picture> picture = job_.get();
      if (picture->whole) show(*picture);
      fine_ = picture->whole;
    }
  } else if (!fine_ && now - since_change_ > kRest) {
    startFine(width, height);
  }
  useMaterial(quad_, material_);
  quad_->setVisible(texture_.get() != nullptr);
}

void VolumeVisual::postRenderTargetUpdate(const Ogre::RenderTargetEvent&) {
  quad_->setVisible(false);
}

}  // namespace vest::displays

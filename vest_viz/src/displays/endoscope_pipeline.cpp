#include "endoscope_pipeline.h"

#include <chrono>
#include <thread>

#include "ogre_assets.h"

namespace vest::displays {
namespace {

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

bool byField(EndoscopePipeline::Smoke method) {
  return (static_cast<int>(method) & 1) != 0;
}
bool byBillboards(EndoscopePipeline::Smoke method) {
  return (static_cast<int>(method) & 2) != 0;
}

}  // namespace

void EndoscopePipeline::setCamera(const camera::Intrinsics& camera, double circle, double resolution) {
  camera_ = camera;
  ++camera_version_;
  finisher_ = std::make_unique<picture::Finisher>(camera, circle, resolution);
  finisher_->setLook(look_);
  finisher_->setLens(lens_);
  scene_.setCamera(finisher_->source(), finisher_->sourceRadius());
}

void EndoscopePipeline::setLook(const picture::CameraLook& look) {
  look_ = look;
  if (finisher_) finisher_->setLook(look);
}

void EndoscopePipeline::settle(const mesh::Store& store) {
  setTissue(store);
  while (!takeBakedTextures() || !scene_.settled()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    setTissue(store);
  }
}

void EndoscopePipeline::setSmoke(const vest_msgs::SmokeState::ConstPtr& m) {
  smoke_ = m;
  smoke_field_.origin = {m->origin.x, m->origin.y, m->origin.z};
  smoke_field_.cell = m->cell;
  for (std::size_t k = 0; k < 3; ++k) smoke_field_.size[k] = m->size[k];
  smoke_field_.scale = m->density_scale;
  smoke_field_.density = m->density;
}

void EndoscopePipeline::setLens(const vest_msgs::LensState::ConstPtr& m) {
  lens_.fog = m->fog;
  lens_.columns = static_cast<int>(m->columns);
  lens_.rows = static_cast<int>(m->rows);
  lens_.soiling = m->soiling;
  lens_.blood = m->soiling_blood;
  if (finisher_) finisher_->setLens(lens_);
}

void EndoscopePipeline::clear() {
  scene_.effects().clear();
  fluid_.reset();
  smoke_.reset();
  smoke_field_ = {};
  lens_ = {};
  if (finisher_) finisher_->setLens(lens_);
}

EndoscopePipeline::Timing EndoscopePipeline::draw(const Eigen::Isometry3d& X_WO, double time, double dt,
                                                  cv::Mat* out) {
  Timing timing;
  const double start = seconds();
  scene_.setPose(X_WO);
  scene_.setGain(fixed_gain_ > 0 ? fixed_gain_ : exposure_.gain());
  if (fluid_) scene_.effects().setFluid(*fluid_, X_WO.translation());
  if (smoke_) scene_.effects().setSmoke(*smoke_, X_WO.translation(), byBillboards(method_));
  const double prepared = seconds();
  const EndoscopeScene::Timing rendered = scene_.render(&rendering_);
  const double read = seconds();
  if (smoke_ && byField(method_))
    veil_.draw(smoke_field_, finisher_->source(), X_WO, rendering_, time, scene_.light(), &veil_picture_);
  else
    veil_picture_.release();
  finisher_->apply(rendering_, veil_picture_, out);
  exposure_.update(*out, finisher_->circle(), dt);
  timing.prepare = prepared - start;
  timing.draw = rendered.draw;
  timing.read = rendered.read;
  timing.finish = seconds() - read;
  return timing;
}

}  // namespace vest::displays

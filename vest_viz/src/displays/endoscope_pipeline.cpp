#include "endoscope_pipeline.h"

#include <chrono>
#include <thread>

#include "ogre_assets.h"
#include "steady_seconds.h"

namespace vest::displays {
namespace {
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
  scene_.setCamera(finisher_->source(), finisher_->sourceRadius(), resolution);
}

void EndoscopePipeline::setLook(const picture::CameraLook& look) {
  look_ = look;
  look_changed_ = true;
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
  lens_.fogging = m->fogging;
  lens_.soiling = m->soiling;
  lens_.blood = m->soiling_blood;
  lens_changed_ = true;
}

void EndoscopePipeline::setGas(const vest_msgs::GasState::ConstPtr& m) {
  scene_.setSunk(std::isfinite(m->sunk) ? std::max(0.0, static_cast<double>(m->sunk)) : 0.0);
}

void EndoscopePipeline::clear() {
  scene_.setSunk(0);
  scene_.effects().clear();
  scene_.setHeld({});
  fluid_.reset();
  smoke_.reset();
  smoke_field_ = {};
  lens_ = {};
  lens_changed_ = true;
}

EndoscopePipeline::Timing EndoscopePipeline::render(const Eigen::Isometry3d& X_WO, double time, double dt) {
  Timing timing;
  const double start = seconds();
  scene_.setPose(X_WO);
  rendered_.gain = gain_;
  scene_.setGain(fixed_gain_ > 0 ? fixed_gain_ : gain_);
  if (fluid_) {
    scene_.effects().setFluid(fluid_, X_WO.translation());
    scene_.setSwabs(*fluid_);
    scene_.setMoment(fluid_->header.stamp.toSec());
  }
  if (smoke_) scene_.effects().setSmoke(*smoke_, X_WO.translation(), byBillboards(method_));
  timing.prepare = seconds() - start;
  const EndoscopeScene::Timing rendered = scene_.render(&rendered_.rgba);
  timing.draw = rendered.draw;
  timing.read = rendered.read;
  rendered_.X_WO = X_WO;
  rendered_.time = time;
  rendered_.dt = dt;
  rendered_.light = scene_.light();
  return timing;
}

void EndoscopePipeline::handOver() {
  std::swap(rendered_, handed_over_);
  handed_over_.smoky = smoke_ && byField(method_);
  if (handed_over_.smoky) handed_over_.smoke = smoke_field_;
  if (look_changed_) finisher_->setLook(look_);
  if (lens_changed_) finisher_->setLens(lens_);
  look_changed_ = lens_changed_ = false;
  gain_ = exposure_.gain();
}

double EndoscopePipeline::finish(cv::Mat* out) {
  const double start = seconds();
  const Rendered& r = handed_over_;
  if (r.smoky)
    veil_.draw(r.smoke, finisher_->source(), r.X_WO, r.rgba, r.time, r.light, &veil_picture_);
  else
    veil_picture_.release();
  finisher_->apply(r.rgba, veil_picture_, out);
  exposure_.update(*out, finisher_->circle(), r.dt, r.gain);
  return seconds() - start;
}

EndoscopePipeline::Timing EndoscopePipeline::draw(const Eigen::Isometry3d& X_WO, double time, double dt,
                                                  cv::Mat* out) {
  Timing timing = render(X_WO, time, dt);
  handOver();
  timing.finish = finish(out);
  gain_ = exposure_.gain();
  return timing;
}

}  // namespace vest::displays

#include "endoscope_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <OgreCamera.h>
#include <OgreHardwarePixelBuffer.h>
#include <OgreManualObject.h>
#include <OgreRenderTexture.h>
#include <OgreRoot.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTextureManager.h>
#include <OgreViewport.h>

#include "conversion.h"
#include "ogre_assets.h"
#include "ogre_versions.h"
#include "steady_seconds.h"
#include "vest_instruments/tools/tool_kind.h"
#include "vest_viz/instrument/shadow.h"

namespace vest::displays {
namespace {
constexpr double kNear = 0.002,
                 kFar = 0.8;            // m; rviz's Camera display clips at 10 mm, where an endoscope works
constexpr double kLightOffset = 0.004;  // m above the lens: fibre bundle beside the optics of a 10 mm tube
constexpr double kLightIntensity = 0.0035;  // m2: gain 1 exposes a place 6 cm away
constexpr float kFinest = -0.5f;  // level of the textures: below it vessels break into dashes (by eye)
}  // namespace

EndoscopeScene::EndoscopeScene(int quality) {
  loadOgreMedia();
  manager_ = Ogre::Root::getSingleton().createSceneManager(
      Ogre::DefaultSceneManagerFactory::FACTORY_TYPE_NAME, uniqueName("endoscope"));
  manager_->setAmbientLight(Ogre::ColourValue(0.3f, 0.25f, 0.25f));
  camera_ = manager_->createCamera(uniqueName("camera"));
  camera_node_ = manager_->getRootSceneNode()->createChildSceneNode();
  camera_node_->attachObject(camera_);
  camera_->setNearClipDistance(kNear);
  camera_->setFarClipDistance(kFar);
  tissue_ = std::make_unique<TissueVisual>(manager_, manager_->getRootSceneNode(), quality, true);
  effects_ = std::make_unique<EffectsVisual>(manager_, manager_->getRootSceneNode(), true);
}

EndoscopeScene::~EndoscopeScene() {
  instruments_.clear();
  effects_.reset();
  tissue_.reset();
  if (stop_ != nullptr) manager_->destroyManualObject(stop_);
  if (target_ != nullptr) target_->removeAllViewports();
  drop(target_texture_);
  Ogre::Root::getSingleton().destroySceneManager(manager_);
}

void EndoscopeScene::setCamera(const camera::Intrinsics& source, double circle, double resolution) {
  source_ = source;
  // A rendering that is enlarged keeps the detail of the picture.
  tissue_->setMipBias(std::max(kFinest, static_cast<float>(std::log2(std::min(resolution, 1.0)))));
  if (target_ != nullptr) target_->removeAllViewports();
  drop(target_texture_);
  target_texture_ = Ogre::TextureManager::getSingleton().createManual(
      uniqueName("picture"), kOgreGroup, Ogre::TEX_TYPE_2D, source.width, source.height, 0,
      Ogre::PF_BYTE_RGBA, Ogre::TU_RENDERTARGET);
  target_ = target_texture_->getBuffer()->getRenderTarget();
  target_->setAutoUpdated(false);
  Ogre::Viewport* viewport = target_->addViewport(camera_);
  viewport->setOverlaysEnabled(false);
  viewport->setShadowsEnabled(false);
  viewport->setSkiesEnabled(false);
  viewport->setBackgroundColour(Ogre::ColourValue(0, 0, 0, 0));  // alpha 0: far away
  const Eigen::Matrix4d P = camera::glProjection(source, kNear, kFar);
  Ogre::Matrix4 projection;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) projection[r][c] = static_cast<float>(P(r, c));
  camera_->setCustomProjectionMatrix(true, projection);
  buildStop(circle);
}

void EndoscopeScene::buildStop(double circle) {
  if (stop_ != nullptr) manager_->destroyManualObject(stop_);
  stop_ = manager_->createManualObject(uniqueName("stop"));
  stop_->setUseIdentityProjection(true);
  stop_->setUseIdentityView(true);
  stop_->setCastShadows(false);
  Ogre::AxisAlignedBox everywhere;
  everywhere.setInfinite();
  stop_->begin("vest_viz/Stop", Ogre::RenderOperation::OT_TRIANGLE_STRIP, kOgreGroup);
  constexpr int kParts = 96;
  const double inner = circle * 1.012 / std::cos(3.14159265 / kParts);
  for (int i = 0; i <= kParts; ++i) {
    const double a = 2 * 3.14159265358979 * i / kParts;
    for (double r : {inner, 2.0}) {
      stop_->position(static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)), -0.999f);
      stop_->colour(0, 0, 0);
    }
  }
  stop_->end();
  stop_->setBoundingBox(everywhere);
  stop_->setRenderQueueGroup(Ogre::RENDER_QUEUE_BACKGROUND);
  manager_->getRootSceneNode()->attachObject(stop_);
}

void EndoscopeScene::setHeld(const vest_msgs::TissueAttachments& attachments) {
  held_.clear();
  for (const vest_msgs::TissueAttachment& a : attachments.attachments)
    if (a.kind == vest_msgs::TissueAttachment::GRASP) held_[a.instrument] = a.object;
}

void EndoscopeScene::updateTissue(const mesh::Store& store) {
  TissueVisual::Held held;
  for (const auto& [instrument, object] : held_) {
    instrument::Jaws jaws;
    const auto visual = instruments_.find(instrument);
    if (visual != instruments_.end() && visual->second->jaws(&jaws)) held[object].push_back(jaws);
  }
  tissue_->setHeld(std::move(held));
  std::vector<mesh::TentPole> poles;
  for (const auto& [instrument, visual] : instruments_) {
    mesh::TentPole pole;
    if (visual->shaft(&pole.from, &pole.to, &pole.radius)) poles.push_back(pole);
  }
  tissue_->setSunk(sunk_, X_WO_.translation(), std::move(poles));
  tissue_->update(store);
}

void EndoscopeScene::updateInstruments(const vest_msgs::InstrumentStates& states) {
  for (auto& [name, visual] : instruments_) {
    bool present = false;
    for (const auto& state : states.instruments) present = present || state.name == name;
    if (!present) visual->setVisible(false);
  }
  for (const vest_msgs::InstrumentState& state : states.instruments) {
    if (state.tool == vest_msgs::InstrumentState::TOOL_ENDOSCOPE || state.name == "endoscope") continue;
    Eigen::Isometry3d pose;
    auto& visual = instruments_[state.name];
    if (!visual) visual = std::make_unique<InstrumentVisual>(manager_, manager_->getRootSceneNode(), true);
    const double jaw = std::isfinite(state.joint_position[4]) ? state.joint_position[4] : 0.0;
    if (!toPose(state.tip, &pose)) continue;
    visual->setTool(state.tool);
    visual->setVisible(true);
    visual->setPose(pose, jaw);
  }
}

void EndoscopeScene::setSwabs(const vest_msgs::FluidState& fluid) {
  for (std::size_t i = 0; i < fluid.swab_volume.size(); ++i) {
    const auto visual =
        instruments_.find(std::string(tools::instrumentName(static_cast<tools::Instrument>(i))));
    if (visual == instruments_.end()) continue;
    const float volume = fluid.swab_volume[i];
    visual->second->setSoaked(fluid.swab_capacity > 0 ? std::min(volume / fluid.swab_capacity, 1.0f) : 0.0f,
                              volume > 0 ? std::min(fluid.swab_blood[i] / volume, 1.0f) : 0.0f);
  }
}

void EndoscopeScene::setPose(const Eigen::Isometry3d& X_WO) {
  X_WO_ = X_WO;
  // OGRE's camera looks along -z with y up.
  const Eigen::Quaterniond q(X_WO.linear() *
                             Eigen::AngleAxisd(3.14159265358979323846, Eigen::Vector3d::UnitX()));
  camera_node_->setPosition(static_cast<float>(X_WO.translation().x()),
                            static_cast<float>(X_WO.translation().y()),
                            static_cast<float>(X_WO.translation().z()));
  camera_node_->setOrientation(static_cast<float>(q.w()), static_cast<float>(q.x()),
                               static_cast<float>(q.y()), static_cast<float>(q.z()));
}

double EndoscopeScene::light() const {
  return kLightIntensity * gain_;
}

TissueVisual::Shafts EndoscopeScene::shafts() const {
  TissueVisual::Shafts all;
  all.fill(Ogre::Vector4::ZERO);
  std::size_t next = 0;
  for (const auto& [name, visual] : instruments_) {
    Eigen::Vector3d ends[2];
    double radius = 0;
    if (next + 2 > all.size() || !visual->shaft(&ends[0], &ends[1], &radius)) continue;
    for (const Eigen::Vector3d& end : ends) {
      const Eigen::Vector3d p = X_WO_.inverse() * end;  // OGRE's view has y up and looks along -z
      all[next++] = Ogre::Vector4(static_cast<float>(p.x()), static_cast<float>(-p.y()),
                                  static_cast<float>(-p.z()), static_cast<float>(radius));
    }
  }
  return all;
}

TissueVisual::Shadows EndoscopeScene::shadowsOf(const TissueVisual::Shafts& shafts) {
  TissueVisual::Shadows all;
  all.fill(Ogre::Vector4::ZERO);
  const Eigen::Vector3d lamp(0, kLightOffset, 0);
  const auto point = [&](std::size_t i) { return Eigen::Vector3d(shafts[i].x, shafts[i].y, shafts[i].z); };
  // Each costs in every pixel: the two whose ends are nearest, which hide most.
  std::vector<std::pair<double, std::size_t>> nearest;
  for (std::size_t i = 0; i < shafts.size(); i += 2)
    if (shafts[i].w > 0) nearest.emplace_back((point(i) - lamp).norm(), i);
  std::sort(nearest.begin(), nearest.end());
  for (std::size_t k = 0; k < std::min<std::size_t>(nearest.size(), 2); ++k) {
    const std::size_t i = nearest[k].second;
    const auto shadow =
        instrument::castShadow(lamp, point(i), point(i + 1), static_cast<double>(shafts[i].w)).rows;
    for (int r = 0; r < 3; ++r)
      all[3 * k + static_cast<std::size_t>(r)] =
          Ogre::Vector4(shadow(r, 0), shadow(r, 1), shadow(r, 2), shadow(r, 3));
  }
  return all;
}

EndoscopeScene::Timing EndoscopeScene::render(cv::Mat* rgba) {
  Timing timing;
  if (target_ == nullptr) return timing;
  complete_ = takeBakedTextures() && tissue_->settled();
  const Ogre::Vector4 light(0.0f, static_cast<float>(kLightOffset), 0.0f, static_cast<float>(this->light()));
  tissue_->setLight(light);
  const Eigen::Vector3d down = X_WO_.linear().transpose() * -Eigen::Vector3d::UnitZ();  // OGRE's y is up
  tissue_->setMoment({static_cast<float>(down.x()), static_cast<float>(-down.y()),
                      static_cast<float>(-down.z()), static_cast<float>(std::fmod(moment_, 512.0))});
  const TissueVisual::Shafts shafts = this->shafts();
  tissue_->setShafts(shafts);
  tissue_->setShadows(shadowsOf(shafts));
  effects_->setLight(light);
  for (auto& [name, visual] : instruments_) {
    visual->setLight(light);
    visual->setDetail(X_WO_.translation(), source_.fx);
  }
  const double start = seconds();
  target_->update();
  const double drawn = seconds();
  rgba->create(static_cast<int>(source_.height), static_cast<int>(source_.width), CV_8UC4);
  const Ogre::PixelBox box(source_.width, source_.height, 1, Ogre::PF_BYTE_RGBA, rgba->data);
  target_texture_->getBuffer()->blitToMemory(box);
  timing.draw = drawn - start;
  timing.read = seconds() - drawn;
  return timing;
}

std::string EndoscopeScene::warning() const {
  if (!tissue_->warning().empty()) return tissue_->warning();
  if (!effects_->warning().empty()) return effects_->warning();
  for (const auto& [name, visual] : instruments_)
    if (!visual->warning().empty()) return visual->warning();
  return {};
}

}  // namespace vest::displays

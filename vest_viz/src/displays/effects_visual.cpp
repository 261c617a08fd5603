#include "effects_visual.h"

#include <algorithm>
#include <cmath>

#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreTextureUnitState.h>

#include "conversion.h"
#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {
namespace {

// A medium-large titanium clip: 8 mm closed (as vest_instruments/tool_geometry), legs of 0.6 mm wire;
// assumed.
constexpr double kClipLength = 0.008, kClipWire = 0.0003, kClipGap = 0.0004;
constexpr double kSlingRadius = 0.00025;  // m: USP 0 catgut is 0.40 … 0.50 mm thick
constexpr double kShutter = 0.008;        // s: of an endoscope's camera in good light; assumed
constexpr std::size_t kMostDrops = 40000, kMostPuffs = 400;

void setConstant(const Ogre::MaterialPtr& material, const char* name, const Ogre::Vector4& value,
                 bool vertex) {
  forEachPass(material, [&](Ogre::Pass* pass) {
    if (!(vertex ? pass->hasVertexProgram() : pass->hasFragmentProgram())) return;
    const auto parameters =
        vertex ? pass->getVertexProgramParameters() : pass->getFragmentProgramParameters();
    parameters->setIgnoreMissingParams(true);
    parameters->setNamedConstant(name, value);
  });
}

}  // namespace

EffectsVisual::EffectsVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, bool depth_in_alpha)
    : manager_(manager), node_(parent->createChildSceneNode()), depth_in_alpha_(depth_in_alpha) {}

EffectsVisual::~EffectsVisual() {
  const auto destroy = [](Surface& s) {
    s.mesh.reset();
    drop(s.material);
  };
  for (Surface* s : {&metal_, &thread_, &target_, &film_, &drop_, &puff_}) destroy(*s);
  for (Surface& s : pool_) destroy(s);
  node_->getParentSceneNode()->removeChild(node_);
  manager_->destroySceneNode(node_);
}

void EffectsVisual::make(Surface* s, const char* material, std::uint8_t queue) {
  if (s->mesh) return;
  s->material = cloneMaterial(material);
  if (warning_.empty()) warning_ = unsupported(s->material);
  s->mesh = std::make_unique<DynamicMesh>(manager_, node_, s->material, queue);
}

void EffectsVisual::show(Surface* s, const instrument::TriangleMesh& mesh) {
  // Threads move more often than they change their number of knots.
  if (s->triangles != mesh.triangles) {
    s->triangles = mesh.triangles;
    s->mesh->setShape(mesh.triangles, {}, {}, mesh.positions.size() / 3);
  }
  s->mesh->setVertices(mesh.positions, mesh.normals, {});
  s->mesh->setVisible(visible_ && !mesh.triangles.empty());
}

void EffectsVisual::show(Surface* s, effects::Quads* quads) {
  const std::size_t n = quads->count();
  s->mesh->setVisible(visible_ && n > 0);
  if (n == 0) return;
  if (n > s->capacity) {
    s->capacity = std::max<std::size_t>(64, 2 * n);
    std::vector<std::uint32_t> triangles;
    std::vector<float> corners;
    for (std::uint32_t q = 0; q < s->capacity; ++q) {
      for (std::uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u}) triangles.push_back(4 * q + k);
      corners.insert(corners.end(), {-1, -1, 1, -1, 1, 1, -1, 1});
    }
    s->mesh->setShape(triangles, corners, {}, 4 * s->capacity);
  }
  // Quads that are not used have no area.
  for (std::vector<float>* values : {&quads->corners, &quads->colours, &quads->features})
    values->resize(12 * s->capacity, 0.0f);
  s->mesh->setVertices(quads->corners, quads->colours, quads->features);
  for (std::vector<float>* values : {&quads->corners, &quads->colours, &quads->features})
    values->resize(12 * n);
}

void EffectsVisual::setAttachments(const vest_msgs::TissueAttachments& attachments) {
  clips_mesh_ = {};
  for (const vest_msgs::TissueAttachment& a : attachments.attachments) {
    Eigen::Isometry3d X;
    if (a.kind != vest_msgs::TissueAttachment::CLIP || !toPose(a.pose, &X)) continue;
    const double closure = std::isfinite(a.closure) ? std::clamp(a.closure, 0.0, 1.0) : 1.0;
    effects::append(&clips_mesh_, effects::clip(kClipLength, kClipGap + (1 - closure) * 0.002, kClipWire), X);
  }
  rebuildMetal();
}

void EffectsVisual::rebuildMetal() {
  metal_mesh_ = clips_mesh_;
  effects::append(&metal_mesh_, needles_mesh_, Eigen::Isometry3d::Identity());
  if (metal_mesh_.triangles.empty() && !metal_.mesh) return;
  if (!metal_.mesh) {
    make(&metal_, "vest_viz/Metal", Ogre::RENDER_QUEUE_MAIN - 5);
    setConstant(metal_.material, "metal", Ogre::Vector4(0.85f, 0.0f, 0.0f, 0.01f), false);
    setConstant(metal_.material, "depth_in_alpha", Ogre::Vector4(depth_in_alpha_ ? 1.0f : 0.0f, 0, 0, 0),
                false);
  }
  show(&metal_, metal_mesh_);
}

void EffectsVisual::setSutures(const vest_msgs::SutureStates& sutures) {
  needles_mesh_ = {};
  thread_mesh_ = {};
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
  for (const vest_msgs::SutureNeedle& needle : sutures.needles)
    effects::append(&needles_mesh_,
                    effects::needle(needle.positions.data(), needle.positions.size() / 3, needle.wire_radius),
                    here);
  for (const vest_msgs::SutureThread& thread : sutures.threads)
    effects::append(&thread_mesh_,
                    effects::tube(thread.positions.data(), thread.positions.size() / 3,
                                  std::clamp<double>(thread.radius, 0.00005, 0.002), false),
                    here);
  for (const vest_msgs::SutureSling& sling : sutures.slings) {
    effects::append(&thread_mesh_,
                    effects::tube(sling.positions.data(), sling.positions.size() / 3, kSlingRadius, true),
                    here);
    effects::append(&thread_mesh_,
                    effects::ball({sling.knot.x, sling.knot.y, sling.knot.z}, 2.2 * kSlingRadius), here);
  }
  rebuildMetal();
  if (thread_mesh_.triangles.empty() && !thread_.mesh) return;
  if (!thread_.mesh) {
    make(&thread_, "vest_viz/Metal", Ogre::RENDER_QUEUE_MAIN - 5);
    // Dyed violet, as absorbable threads are, so that they stand out from tissue.
    setConstant(thread_.material, "metal", Ogre::Vector4(0.15f, 0.9f, 0.0f, 0.5f), false);
    setConstant(thread_.material, "colour", Ogre::Vector4(0.42f, 0.28f, 0.62f, 0), false);
    setConstant(thread_.material, "depth_in_alpha", Ogre::Vector4(depth_in_alpha_ ? 1.0f : 0.0f, 0, 0, 0),
                false);
  }
  show(&thread_, thread_mesh_);
}

void EffectsVisual::setTargets(const instrument::TriangleMesh& lines) {
  if (lines.triangles.empty() && !target_.mesh) return;
  if (!target_.mesh) {
    make(&target_, "vest_viz/Metal", Ogre::RENDER_QUEUE_MAIN - 5);
    // Ink of a surgical marker: gentian violet, nearly black, dull.
    setConstant(target_.material, "metal", Ogre::Vector4(0.0f, 1.0f, 0.0f, 0.5f), false);
    setConstant(target_.material, "colour", Ogre::Vector4(0.05f, 0.02f, 0.09f, 0), false);
    setConstant(target_.material, "depth_in_alpha", Ogre::Vector4(depth_in_alpha_ ? 1.0f : 0.0f, 0, 0, 0),
                false);
  }
  show(&target_, lines);
}

void EffectsVisual::setFluid(const vest_msgs::FluidState::ConstPtr& message, const Eigen::Vector3d& eye) {
  static const vest_msgs::FluidState kNone;
  const vest_msgs::FluidState& fluid = message ? *message : kNone;
  drops_.clear();
  effects::FluidParticles particles;
  const std::size_t n = particles.count = std::min(fluid.positions.size() / 3, kMostDrops);
  particles.positions = fluid.positions.data();
  if (fluid.velocities.size() >= 3 * n) particles.velocities = fluid.velocities.data();
  if (fluid.blood_fraction.size() >= n) particles.blood = fluid.blood_fraction.data();
  if (fluid.volume.size() >= n) particles.volume = fluid.volume.data();
  particles.radius = fluid.particle_radius;
  effects::addDrops(particles, eye, kShutter, &drops_);
  for (const vest_msgs::FluidPool& pool : fluid.pools)
    effects::addBubbles(pool.bubbles.data(), pool.bubbles.size() / 4, eye, &drops_);
  if (drops_.count() > 0) make(&drop_, "vest_viz/Drops", Ogre::RENDER_QUEUE_MAIN + 20);
  if (drop_.mesh) show(&drop_, &drops_);
  if (message && message == fluid_) return;
  fluid_ = message;
  showPools(fluid);
}

void EffectsVisual::showPools(const vest_msgs::FluidState& fluid) {
  pools_.clear();
  for (const vest_msgs::FluidPool& pool : fluid.pools) {
    Eigen::Isometry3d X;
    const std::uint64_t cells = static_cast<std::uint64_t>(pool.columns) * pool.rows;
    if (!toPose(pool.origin, &X) || cells != pool.height.size() || cells == 0 || cells > 1000000) continue;
    effects::PoolCells of;
    of.height = pool.height.data();
    if (pool.depth.size() == cells) of.depth = pool.depth.data();
    if (pool.blood.size() == cells) of.blood = pool.blood.data();
    if (pool.velocity.size() == cells) of.velocity = pool.velocity.data();
    of.blood_fraction =
        std::isfinite(pool.blood_fraction) ? std::clamp(pool.blood_fraction, 0.0f, 1.0f) : 1.0;
    pools_.push_back(effects::poolSurface(X, pool.cell, pool.columns, pool.rows, of));
  }
  // Waves go on with the session's time, which repeats after a while: a shader's numbers are short.
  const Ogre::Vector4 moment(static_cast<float>(std::fmod(fluid.header.stamp.toSec(), 512.0)), 0, 0, 0);
  showFilm(fluid.film, moment);
  while (pool_.size() < pools_.size()) {
    pool_.emplace_back();
    make(&pool_.back(), "vest_viz/Pool", Ogre::RENDER_QUEUE_MAIN + 15);
    forEachPass(pool_.back().material,
                [](Ogre::Pass* pass) { pass->getTextureUnitState("micro")->setTexture(microTexture()); });
  }
  for (std::size_t i = 0; i < pool_.size(); ++i) {
    Surface& s = pool_[i];
    if (i >= pools_.size() || pools_[i].triangles.empty()) {
      s.mesh->setVisible(false);
      continue;
    }
    const effects::Pool& pool = pools_[i];
    if (s.triangles != pool.triangles) {
      s.triangles = pool.triangles;
      s.mesh->setShape(pool.triangles, {}, {}, pool.positions.size() / 3);
    }
    s.mesh->setVertices(pool.positions, pool.normals, pool.features);
    s.mesh->setVisible(visible_);
    setConstant(s.material, "moment", moment, false);
  }
}

void EffectsVisual::showFilm(const vest_msgs::FluidFilm& film, const Ogre::Vector4& moment) {
  Eigen::Isometry3d X;
  const std::uint64_t cells = static_cast<std::uint64_t>(film.columns) * film.rows;
  effects::Pool mesh;
  if (cells > 0 && cells <= 1000000 && cells == film.height.size() && cells == film.thickness.size() &&
      cells == film.set.size() && toPose(film.origin, &X))
    mesh = effects::filmSurface(X, film.cell, film.columns, film.rows, film.height.data(),
                                film.thickness.data(), film.set.data());
  if (mesh.triangles.empty()) {
    if (film_.mesh) film_.mesh->setVisible(false);
    return;
  }
  if (!film_.mesh) {
    make(&film_, "vest_viz/Film", Ogre::RENDER_QUEUE_MAIN + 10);
    forEachPass(film_.material,
                [](Ogre::Pass* pass) { pass->getTextureUnitState("micro")->setTexture(microTexture()); });
  }
  if (film_.triangles != mesh.triangles) {
    film_.triangles = mesh.triangles;
    film_.mesh->setShape(mesh.triangles, {}, {}, mesh.positions.size() / 3);
  }
  film_.mesh->setVertices(mesh.positions, mesh.normals, mesh.features);
  film_.mesh->setVisible(visible_);
  setConstant(film_.material, "moment", moment, false);
}

void EffectsVisual::setSmoke(const vest_msgs::SmokeState& smoke, const Eigen::Vector3d& eye,
                             bool billboards) {
  puffs_.clear();
  if (billboards) {
    // Far ones first, so that they blend.
    std::vector<std::pair<double, const vest_msgs::SmokePuff*>> order;
    for (const vest_msgs::SmokePuff& p : smoke.puffs) {
      const double d = (Eigen::Vector3d(p.position.x, p.position.y, p.position.z) - eye).squaredNorm();
      if (std::isfinite(d)) order.emplace_back(-d, &p);
    }
    std::sort(order.begin(), order.end());
    if (order.size() > kMostPuffs) order.erase(order.begin(), order.end() - kMostPuffs);
    for (const auto& [d, p] : order)
      effects::addPuff({p->position.x, p->position.y, p->position.z}, p->radius, p->density, p->phase,
                       p->seed, eye, &puffs_);
  }
  if (puffs_.count() > 0 && !puff_.mesh) {
    make(&puff_, "vest_viz/Puffs", Ogre::RENDER_QUEUE_MAIN + 25);
    puff_.material->getTechnique(0)->getPass(0)->getTextureUnitState("noise")->setTexture(cloudTexture());
  }
  if (puff_.mesh) show(&puff_, &puffs_);
}

void EffectsVisual::setLight(const Ogre::Vector4& light) {
  for (Surface* s : {&metal_, &thread_, &target_, &film_})
    if (s->material.get()) setConstant(s->material, "light", light, false);
  for (Surface* s : {&drop_, &puff_})
    if (s->material.get()) setConstant(s->material, "light", light, true);
  for (Surface& s : pool_) setConstant(s.material, "light", light, false);
}

void EffectsVisual::setVisible(bool visible) {
  visible_ = visible;
  fluid_.reset();  // what is hidden of its pools was shown by this
  node_->setVisible(visible, true);
}

void EffectsVisual::clear() {
  setAttachments({});
  setSutures({});
  setTargets({});
  setFluid(nullptr, Eigen::Vector3d::Zero());
  setSmoke({}, Eigen::Vector3d::Zero(), false);
}

}  // namespace vest::displays

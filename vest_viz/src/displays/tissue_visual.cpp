#include "tissue_visual.h"

#include <algorithm>
#include <cmath>

#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreTextureUnitState.h>
#include <vest_msgs/TissueField.h>

#include "ogre_assets.h"
#include "ogre_versions.h"
#include "tissue_input.h"
#include "vest_tissue/net/skin.h"
#include "vest_viz/inspect/colour_map.h"
#include "vest_viz/texture/organ_texture.h"

namespace vest::displays {

namespace {

// Fields of vest_msgs/TissueField that show, in the order of the shader's bytes, and the values that are
// invisible and complete. Bleeding: 2 mm3/s at a knot (0.12 ml/min, knots stand some 4 mm apart) covers the
// skin round it; assumed.
struct Shown {
  std::uint8_t kind;
  float low, high;
};
/// Blood that lies on the skin shows like blood that comes out of it, but never as deep: it lets the relief
/// through (tuned).
constexpr Shown kFilm{vest_msgs::TissueField::WETNESS, 0.0f, 1.6f};
/// What its vessels bring less of shows like what it has lost itself. The first tenth is not seen: a beat
/// takes 4 % of it, and a collateral brings 93 % (of the gynaecology scene; tuned).
constexpr Shown kSupplied{TissueInput::kSupply, 0.9f, 0.1f};
/// Blood without oxygen looks blue from 5 g/dl of reduced haemoglobin on, a third of all (Lundsgaard 1919);
/// at rest a fifth is. Blood that comes back is redder than before.
constexpr Shown kBlue{vest_msgs::TissueField::OXYGENATION, 0.70f, 0.20f};
constexpr Shown kFlushed{vest_msgs::TissueField::OXYGENATION, 0.84f, 0.96f};
constexpr Shown kSet{vest_msgs::TissueField::SETTING, 0.0f, 1.0f};
constexpr std::size_t kBloodless = 3;  ///< of kShown
constexpr std::array<Shown, DynamicMesh::kState> kShown{{{vest_msgs::TissueField::BLEEDING, 0.0f, 2e-9f},
                                                         {vest_msgs::TissueField::DAMAGE, 0.0f, 1.0f},
                                                         {vest_msgs::TissueField::CHAR, 0.0f, 1.0f},
                                                         {vest_msgs::TissueField::PERFUSION, 1.0f, 0.0f},
                                                         kBlue,
                                                         kFlushed,
                                                         kSet}};

// m: a pixel of the standard view is 0.2 mm wide at 8 cm.
constexpr double kCoarse = 0.0001;
constexpr double kCoarseWall = 0.0003;          // m: of walls behind the organs
constexpr std::size_t kMostTriangles = 100000;  // above, a worker would need too long
/// m: from here on a dent or a waist that fewer triangles do not follow is drawn with all of them, down to
/// half of it: some three pixels of the standard view (tuned).
constexpr float kBent = 0.0005f;

/// m: mean length of the links between knots.
float knotDistance(const mesh::Object& o) {
  double sum = 0;
  std::size_t count = 0;
  const auto add = [&](std::size_t a, std::size_t b) {
    double squared = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      const double off =
          static_cast<double>(o.rest_position[3 * a + d]) - static_cast<double>(o.rest_position[3 * b + d]);
      squared += off * off;
    }
    sum += std::sqrt(squared);
    ++count;
  };
  for (std::size_t k = 0; k + 1 < o.link_knots.size(); k += 2) add(o.link_knots[k], o.link_knots[k + 1]);
  for (std::size_t k = 0; k + 3 < o.tetrahedra.size(); k += 4) add(o.tetrahedra[k], o.tetrahedra[k + 1]);
  return count == 0 ? 0 : static_cast<float>(sum / static_cast<double>(count));
}

bool anyShown(const mesh::Store& store) {
  return store.field(kFilm.kind) != nullptr || store.field(kSupplied.kind) != nullptr ||
         std::any_of(kShown.begin(), kShown.end(),
                     [&](const Shown& s) { return store.field(s.kind) != nullptr; });
}

void setMipmapBias(Ogre::Pass* pass, float bias) {
  for (unsigned short i = 0; i < pass->getNumTextureUnitStates(); ++i)
    pass->getTextureUnitState(i)->setTextureMipmapBias(bias);
}

}  // namespace

TissueVisual::TissueVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, int quality,
                           bool depth_in_alpha)
    : manager_(manager),
      node_(parent->createChildSceneNode()),
      quality_(quality),
      depth_in_alpha_(depth_in_alpha) {}

TissueVisual::~TissueVisual() {
  stop_ = true;
  if (baking_.valid()) baking_.wait();
  for (Part& part : parts_) destroy(&part);
  if (links_ != nullptr) manager_->destroyManualObject(links_);
  drop(link_material_);
  node_->getParentSceneNode()->removeChild(node_);
  manager_->destroySceneNode(node_);
}

void TissueVisual::destroy(Part* part) {
  part->mesh.reset();
  drop(part->coloured);
  for (auto* materials : {&part->plain, &part->marked})
    for (Ogre::MaterialPtr& material : *materials) drop(material);
}

template <class F>
void TissueVisual::forEachMaterial(F&& f) {
  for (Part& part : parts_)
    for (auto* materials : {&part.plain, &part.marked})
      for (Ogre::MaterialPtr& material : *materials)
        if (material.get()) f(material->getTechnique(0)->getPass(0));
}

/// Closed skins need no back faces drawn: each edge is used once in each direction.
static bool closed(const std::vector<std::uint32_t>& triangles) {
  std::vector<std::uint64_t> edges;
  edges.reserve(triangles.size());
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k)
      edges.push_back(static_cast<std::uint64_t>(triangles[t + k]) << 32 | triangles[t + (k + 1) % 3]);
  std::sort(edges.begin(), edges.end());
  for (std::uint64_t edge : edges)
    if (!std::binary_search(edges.begin(), edges.end(), edge << 32 | edge >> 32)) return false;
  return !edges.empty();
}

void TissueVisual::prepare(const Ogre::MaterialPtr& material, bool cull) {
  if (warning_.empty()) warning_ = unsupported(material);
  Ogre::Pass* pass = material->getTechnique(0)->getPass(0);
  if (cull) pass->setCullingMode(Ogre::CULL_CLOCKWISE);
  setMipmapBias(pass, mip_bias_);
  if (pass->hasFragmentProgram())
    pass->getFragmentProgramParameters()->setNamedConstant(
        "alpha", Ogre::Vector2(alpha_, depth_in_alpha_ ? 1.0f : 0.0f));
  if (pass->hasVertexProgram() && pass->getVertexProgramName() == "vest_viz/field_vs")
    pass->getVertexProgramParameters()->setNamedConstant("slice", slice_);
  pass->setSceneBlending(alpha_ < 0.999f ? Ogre::SBT_TRANSPARENT_ALPHA : Ogre::SBT_REPLACE);
  pass->setDepthWriteEnabled(alpha_ >= 0.999f);
  letMouseThrough(material, alpha_ < 0.999f);
}

void TissueVisual::rebuildAll(const mesh::Store& store) {
  for (Part& part : parts_) destroy(&part);
  parts_.clear();
  const auto& objects = store.topology().objects;
  parts_.resize(objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    parts_[i].name = objects[i].name;
    parts_[i].organ = objects[i].organ;
  }
  beginBaking(store);
}

void TissueVisual::beginBaking(const mesh::Store& store) {
  stop_ = true;
  if (baking_.valid()) baking_.get();
  stop_ = false;
  std::vector<mesh::Surface> surfaces = mesh::surfacesOf(store);
  std::size_t triangles = 0;
  for (const mesh::Surface& s : surfaces) triangles += s.triangles.size() / 3;
  const bool leave_out = depth_in_alpha_ && quality_ <= 1 && triangles <= kMostTriangles;
  std::vector<double> tolerance(parts_.size(), 0);  // m; 0: every triangle is drawn
  std::vector<bool> refine(parts_.size(), false);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const mesh::Object& o = store.topology().objects[i];
    parts_[i].coarse_version = store.shapeVersion(i);
    if (std::any_of(o.triangle_layer.begin(), o.triangle_layer.end(), [](auto l) { return l != 0; }))
      continue;
    if (leave_out) tolerance[i] = o.rigid ? kCoarseWall : kCoarse;
    refine[i] = depth_in_alpha_ && triangles <= kMostTriangles && o.rigid && store.skin(i).doubled.empty();
  }
  baking_ =
      std::async(std::launch::async, [this, surfaces = std::move(surfaces), tolerance = std::move(tolerance),
                                      refine = std::move(refine)]() mutable {
        Baked baked;
        baked.refined.resize(surfaces.size());
        for (std::size_t i = 0; i < surfaces.size() && !stop_; ++i) {
          if (!refine[i]) continue;
          baked.refined[i] = mesh::refineForContact(surfaces, i);
          baked.refined[i].append(3, &surfaces[i].positions);
          baked.refined[i].append(3, &surfaces[i].normals);
          surfaces[i].triangles = baked.refined[i].triangles;
        }
        baked.occlusion = mesh::ambientOcclusion(surfaces, &stop_);
        baked.coarse.resize(surfaces.size());
        baked.left_out.resize(surfaces.size());
        for (std::size_t i = 0; i < surfaces.size() && !stop_; ++i) {
          const mesh::Surface& s = surfaces[i];
          if (tolerance[i] > 0)
            baked.coarse[i] = mesh::coarseTriangles(s.positions, s.triangles, tolerance[i],
                                                    s.positions.size() / 3 - baked.refined[i].middles.size());
          if (tolerance[i] == kCoarse)
            baked.left_out[i] = mesh::leftOut(s.positions, s.triangles, baked.coarse[i], &stop_);
        }
        return baked;
      });
}

void TissueVisual::takeBaked() {
  if (!baking_.valid() || baking_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  Baked baked = baking_.get();
  for (std::size_t i = 0; i < parts_.size() && i < baked.coarse.size(); ++i) {
    parts_[i].coarse = std::move(baked.coarse[i]);
    parts_[i].left_out = std::move(baked.left_out[i]);
    parts_[i].refined = std::move(baked.refined[i]);
    parts_[i].occlusion = std::move(baked.occlusion[i]);
    parts_[i].coarse_occlusion = mesh::coarseValues(parts_[i].left_out, parts_[i].occlusion);
    parts_[i].stale = true;
  }
}

void TissueVisual::rebuildPart(const mesh::Store& store, std::size_t index) {
  const mesh::Object& o = store.topology().objects[index];
  const mesh::Skin& skin = store.skin(index);
  Part& part = parts_[index];
  part.version = store.shapeVersion(index);
  part.stale = false;
  std::vector<DynamicMesh::Group> groups(kGroups);
  // What happened to the tissue is shown vertex by vertex, and needs them all.
  const bool coarse = !part.coarse.empty() && part.coarse_version == part.version && !part.mark.on() &&
                      !part.is_bent && colouring_.by == Colouring::By::Look;
  const bool refined = fine(part);
  if (coarse) groups[0].triangles = part.coarse;
  const std::vector<std::uint32_t>& all = refined ? part.refined.triangles : skin.triangles;
  for (std::size_t t = 0; !coarse && 3 * t + 2 < all.size(); ++t) {
    const std::uint32_t* v = &all[3 * t];
    if (v[0] == v[1] || v[1] == v[2]) continue;  // died in a cut
    const std::size_t layer = refined || o.triangle_layer.empty() ? 0 : o.triangle_layer[t];
    auto& triangles = groups[std::min(layer, kGroups - 1)].triangles;
    triangles.insert(triangles.end(), v, v + 3);
  }
  part.styles = {o.organ, texture::insideOf(o.organ).organ, texture::insideOf(o.organ).organ};
  // Closed skins need no back faces drawn; a cut opens them.
  part.cull = !o.rigid && groups[2].triangles.empty() && closed(o.triangles);
  for (std::size_t g = 0; g < kGroups; ++g) {
    part.present[g] = !groups[g].triangles.empty();
    if (part.present[g] && !part.plain[g].get()) part.plain[g] = makeTissueMaterial(part.styles[g], quality_);
    for (const Ogre::MaterialPtr& material : {part.plain[g], part.marked[g]}) {
      if (!material.get()) continue;
      material->getTechnique(0)->getPass(0)->setCullingMode(Ogre::CULL_NONE);
      prepare(material, part.cull);
    }
    groups[g].material = part.mark.on() && part.marked[g].get() ? part.marked[g] : part.plain[g];
  }
  // Near and small things first: what they hide is not shaded.
  const std::uint8_t queue = o.rigid ? Ogre::RENDER_QUEUE_MAIN + 5 : Ogre::RENDER_QUEUE_MAIN;
  if (!part.mesh) part.mesh = std::make_unique<DynamicMesh>(manager_, node_, part.plain[0], queue);
  const std::size_t n = skin.vertexCount(), bound = o.vertexCount();
  const texture::Style& style = texture::styleOf(o.organ);
  const texture::Style& inside = texture::insideOf(o.organ);
  const double metres = mesh::metresPerTextureUnit(o, skin.positions.data());
  const float tiles = static_cast<float>(metres / style.tile);
  std::vector<float> uv(2 * n, 0.0f), tint(4 * n, 1.0f);
  for (std::size_t k = 0; k < std::min(uv.size(), skin.uv.size()); ++k) uv[k] = tiles * skin.uv[k];
  // Cut faces are patterned by place, looked at across the face: whatever coordinates they came with.
  std::vector<std::uint8_t> on_skin(n + part.refined.middles.size(), 0);
  for (std::uint32_t v : groups[0].triangles) on_skin[v] = 1;
  const auto per_metre = static_cast<float>(1.0 / inside.tile);
  for (std::uint32_t v : groups[2].triangles) {
    if (on_skin[v]) continue;
    const float* p = &skin.positions[3 * static_cast<std::size_t>(v)];
    const float* m = &skin.normals[3 * static_cast<std::size_t>(v)];
    const float ax = std::fabs(m[0]), ay = std::fabs(m[1]), az = std::fabs(m[2]);
    const int drop = ax > ay && ax > az ? 0 : ay > az ? 1 : 2;
    uv[2 * v] = per_metre * p[(drop + 1) % 3];
    uv[2 * v + 1] = per_metre * p[(drop + 2) % 3];
  }
  // New vertices, and all until the worker has looked: about half open.
  part.occlusion.resize(std::max(bound, part.occlusion.size()), 0.75f);
  const std::vector<float>& open = coarse && part.coarse_occlusion.size() == part.occlusion.size()
                                       ? part.coarse_occlusion
                                       : part.occlusion;
  for (std::size_t v = 0; v < n; ++v) {
    const float* p = &skin.positions[3 * v];
    const std::array<float, 3> c = texture::tintAt(p[0], p[1], p[2], style);
    for (std::size_t k = 0; k < 3; ++k) tint[4 * v + k] = c[k];
    tint[4 * v + 3] = open[v < bound ? v : skin.doubled[v - bound]];
  }
  if (refined) {
    part.refined.append(2, &uv);
    part.refined.append(4, &tint);
    for (std::size_t v = n; v < open.size(); ++v) tint[4 * v + 3] = open[v];
  }
  part.mesh->setShape(groups, uv, tint, uv.size() / 2);
  part.mesh->setVisible(visible(part));
}

/// Whether the object must be built again, since fewer triangles hide what happened to it now, or hide it no
/// more.
bool TissueVisual::judgeBend(const mesh::Store& store, std::size_t index) {
  Part& part = parts_[index];
  if (part.left_out.empty() || part.coarse_version != store.shapeVersion(index)) return false;
  const float gap = mesh::greatestGap(part.left_out, drawnSkin(store, index));
  const bool bent = gap > (part.is_bent ? 0.5f * kBent : kBent);
  if (bent == part.is_bent) return false;
  part.is_bent = bent;
  return true;
}

void TissueVisual::updateState(const mesh::Store& store, std::size_t index) {
  Part& part = parts_[index];
  const std::size_t n = store.skin(index).vertexCount();
  if (n == 0) return;
  // Healthy objects are most: their knots tell it sooner than their vertices.
  float at_knots = store.largestAtKnots(index, kFilm.kind, kFilm.low, kFilm.high);
  at_knots = std::max(at_knots, store.largestAtKnots(index, kSupplied.kind, kSupplied.low, kSupplied.high));
  for (const auto& shown : kShown)
    at_knots = std::max(at_knots, store.largestAtKnots(index, shown.kind, shown.low, shown.high));
  if (at_knots <= mesh::Mark::kLeast && !part.mark.on()) return;
  part.state.resize(kShown.size() * n);
  if (part.smoother_version != store.shapeVersion(index)) {
    part.smoother_version = store.shapeVersion(index);
    part.smoother.build(store.skin(index).triangles, store.skin(index).positions,
                        knotDistance(store.topology().objects[index]));
  }
  float largest = 0;
  for (std::size_t k = 0; k < kShown.size(); ++k)
    largest = std::max(largest, store.vertexField(index, kShown[k].kind, kShown[k].low, kShown[k].high,
                                                  part.state.data() + k, kShown.size()));
  const auto addTo = [&](std::size_t channel, const Shown& shown) {
    if (store.field(shown.kind) == nullptr) return;
    layer_.resize(n);
    largest =
        std::max(largest, store.vertexField(index, shown.kind, shown.low, shown.high, layer_.data(), 1));
    for (std::size_t v = 0; v < n; ++v)
      part.state[kShown.size() * v + channel] = std::max(part.state[kShown.size() * v + channel], layer_[v]);
  };
  addTo(0, kFilm);
  addTo(kBloodless, kSupplied);
  // Blood and char have borders; heat and lost blood fade out.
  for (const std::size_t k : {1u, 3u, 4u, 5u}) part.smoother.smooth(part.state.data() + k, kShown.size());
  if (fine(part)) part.refined.append(kShown.size(), &part.state);
  const bool changed = part.mark.look(largest), mark = part.mark.on();
  if (mark) part.mesh->setState(part.state);
  if (!changed) return;
  for (std::size_t g = 0; g < kGroups; ++g) {
    if (!part.present[g]) continue;
    if (mark && !part.marked[g].get()) {
      part.marked[g] = makeTissueMaterial(part.styles[g], quality_, true);
      prepare(part.marked[g], part.cull);
    }
    part.mesh->setMaterial(g, mark ? part.marked[g] : part.plain[g]);
  }
  if (part.coarse.empty()) return;
  rebuildPart(store, index);  // with all triangles, or fewer again
  upload(store, index);
  if (mark) part.mesh->setState(part.state);
}

void TissueVisual::update(const mesh::Store& store) {
  const bool fresh = store.shapeVersion() != shape_version_;
  const bool fields = store.fieldVersion() != field_version_;
  if (fresh) {
    shape_version_ = store.shapeVersion();
    std::vector<std::string> names;
    for (const mesh::Object& o : store.topology().objects) names.push_back(o.name + "/" + o.organ);
    if (names != names_) {
      names_ = std::move(names);
      rebuildAll(store);
    }
  }
  takeBaked();
  vertices_ = 0;
  const bool shown = anyShown(store);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const bool moved = press(store, i) || store.moved(i);
    const bool bend = (parts_[i].stale || moved) && judgeBend(store, i);
    const bool reshaped = bend || parts_[i].stale || (fresh && parts_[i].version != store.shapeVersion(i));
    if (reshaped) rebuildPart(store, i);
    if (reshaped || moved) upload(store, i);
    if (coloured()) {
      if (fields || reshaped) updateColours(store, i);
    } else if ((fields || reshaped) && (shown || parts_[i].mark.on())) {
      updateState(store, i);
    }
    vertices_ += store.skin(i).vertexCount();
  }
  field_version_ = store.fieldVersion();
  if (show_links_) drawLinks(store);
}

namespace {
/// For vertex programs; one that does not know the name (healthy tissue has no film) is left as it is.
void setVertexNumbers(Ogre::Pass* pass, const char* name, const Ogre::Vector4* values, std::size_t count) {
  if (!pass->hasVertexProgram()) return;
  const auto parameters = pass->getVertexProgramParameters();
  parameters->setIgnoreMissingParams(true);
  parameters->setNamedConstant(name, values->ptr(), count);
}
}  // namespace

void TissueVisual::setLight(const Ogre::Vector4& light) {
  forEachMaterial([&](Ogre::Pass* pass) { setVertexNumbers(pass, "light", &light, 1); });
}
void TissueVisual::setMoment(const Ogre::Vector4& down_and_time) {
  forEachMaterial([&](Ogre::Pass* pass) { setVertexNumbers(pass, "moment", &down_and_time, 1); });
}
void TissueVisual::setShafts(const Shafts& shafts) {
  forEachMaterial([&](Ogre::Pass* pass) { setVertexNumbers(pass, "shaft", shafts.data(), shafts.size()); });
}

void TissueVisual::setShadows(const Shadows& shadows) {
  forEachMaterial(
      [&](Ogre::Pass* pass) { setVertexNumbers(pass, "shadow", shadows.data(), shadows.size()); });
}

void TissueVisual::setMipBias(float bias) {
  mip_bias_ = bias;
  forEachMaterial([&](Ogre::Pass* pass) { setMipmapBias(pass, bias); });
}

void TissueVisual::setAlpha(float alpha) {
  alpha_ = alpha;
  for (Part& part : parts_)
    for (auto* materials : {&part.plain, &part.marked})
      for (Ogre::MaterialPtr& material : *materials)
        if (material.get()) prepare(material, part.cull);
  for (Part& part : parts_)
    if (part.coloured.get()) prepare(part.coloured, false);
}

void TissueVisual::setColouring(const Colouring& colouring, const mesh::Store& store) {
  if (colouring == colouring_) return;
  colouring_ = colouring;
  recolour(store);
}

void TissueVisual::setSlice(const inspect::Plane* plane, const mesh::Store& store) {
  const Ogre::Vector4 slice = plane == nullptr ? Ogre::Vector4(0, 0, 0, 1)
                                               : Ogre::Vector4(-plane->normal.x(), -plane->normal.y(),
                                                               -plane->normal.z(), plane->offset);
  if (slice == slice_ && sliced_ == (plane != nullptr)) return;
  const bool changed = sliced_ != (plane != nullptr);
  slice_ = slice;
  sliced_ = plane != nullptr;
  for (Part& part : parts_)
    if (part.coloured.get()) prepare(part.coloured, false);
  if (changed) recolour(store);
}

void TissueVisual::recolour(const mesh::Store& store) {
  for (std::size_t i = 0; i < parts_.size() && i < store.topology().objects.size(); ++i) {
    parts_[i].stale = parts_[i].stale || !parts_[i].refined.middles.empty();
    if (coloured()) {
      updateColours(store, i);
      continue;
    }
    for (std::size_t g = 0; g < kGroups; ++g)
      if (parts_[i].present[g]) parts_[i].mesh->setMaterial(g, parts_[i].plain[g]);
    parts_[i].mark.clear();
    parts_[i].stale = parts_[i].stale || !parts_[i].coarse.empty();
    updateState(store, i);
  }
}

void TissueVisual::updateColours(const mesh::Store& store, std::size_t index) {
  Part& part = parts_[index];
  const mesh::Object& o = store.topology().objects[index];
  const mesh::Skin& skin = store.skin(index);
  const std::size_t n = skin.vertexCount();
  if (n == 0) return;
  if (!part.coloured.get()) {
    part.coloured = cloneMaterial("vest_viz/Field");
    prepare(part.coloured, false);
  }
  for (std::size_t g = 0; g < kGroups; ++g)
    if (part.present[g]) part.mesh->setMaterial(g, part.coloured);
  std::vector<std::uint8_t>& out = part.state;
  out.assign(DynamicMesh::kState * n, 255);
  const auto put = [&](std::size_t v, const inspect::Colour& c) {
    for (std::size_t k = 0; k < 3; ++k)
      out[DynamicMesh::kState * v + k] = static_cast<std::uint8_t>(255 * c[k] + 0.5f);
  };
  using By = Colouring::By;
  if (colouring_.by == By::Field) {
    const bool known = store.field(colouring_.field) != nullptr;
    std::vector<std::uint8_t> value(n);
    store.vertexField(index, colouring_.field, colouring_.low, colouring_.high, value.data(), 1);
    for (std::size_t v = 0; v < n; ++v)
      put(v, inspect::valueColour(known ? static_cast<float>(value[v]) / 255 : std::nanf("")));
  } else if (colouring_.by == By::Layer) {
    for (std::size_t t = 0; t < o.triangle_layer.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        put(skin.triangles[3 * t + k], inspect::layerColour(o.triangle_layer[t]));
    if (o.triangle_layer.empty())
      for (std::size_t v = 0; v < n; ++v) put(v, inspect::layerColour(0));
  } else if (colouring_.by == By::Look) {
    for (std::size_t v = 0; v < n; ++v) put(v, texture::styleOf(o.organ).base);
  } else {
    const inspect::Colour c = inspect::nameColour(colouring_.by == By::Object  ? o.name
                                                  : colouring_.by == By::Organ ? o.organ
                                                  : o.material.empty()         ? o.name
                                                                               : o.material);
    for (std::size_t v = 0; v < n; ++v) put(v, c);
  }
  part.mesh->setState(out);
}

void TissueVisual::showSurface(bool show) {
  show_surface_ = show;
  applyVisibility();
}

void TissueVisual::showLinks(bool show) {
  show_links_ = show;
  if (links_ != nullptr) links_->setVisible(show);
}

void TissueVisual::setFilter(const std::set<std::string>& names) {
  filter_ = names;
  shows_others_ = std::all_of(names.begin(), names.end(), [](const auto& word) { return word[0] == '-'; });
  applyVisibility();
}

void TissueVisual::applyVisibility() {
  for (Part& part : parts_)
    if (part.mesh) part.mesh->setVisible(visible(part));
}

void TissueVisual::drawLinks(const mesh::Store& store) {
  if (links_ == nullptr) {
    link_material_ = Ogre::MaterialManager::getSingleton().create(uniqueName("links"), kOgreGroup);
    link_material_->setLightingEnabled(false);
    links_ = manager_->createManualObject(uniqueName("links"));
    links_->setDynamic(true);
    links_->setCastShadows(false);
    node_->attachObject(links_);
  }
  links_->clear();
  links_->begin(link_material_->getName(), Ogre::RenderOperation::OT_LINE_LIST, kOgreGroup);
  const auto& objects = store.topology().objects;
  std::size_t lines = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const mesh::Object& o = objects[i];
    if (!shows(o.name, o.organ)) continue;
    for (std::size_t k = 0; 2 * k < o.link_knots.size(); ++k) {
      if (!o.link_alive.empty() && !o.link_alive[k]) continue;
      for (int end = 0; end < 2; ++end) {
        const float* p = store.knots(i) +
                         3 * static_cast<std::size_t>(o.link_knots[2 * k + static_cast<std::size_t>(end)]);
        links_->position(p[0], p[1], p[2]);
        links_->colour(0.1f, 0.85f, 0.75f);
      }
      ++lines;
    }
  }
  if (lines == 0) {  // an empty section is an error for OGRE
    links_->position(0, 0, 0);
    links_->position(0, 0, 0);
  }
  links_->end();
  links_->setVisible(show_links_);
}

}  // namespace vest::displays

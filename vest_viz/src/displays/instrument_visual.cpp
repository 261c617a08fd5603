#include "instrument_visual.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <ros/package.h>

#include "ogre_assets.h"
#include "ogre_versions.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_viz/effects/shapes.h"
#include "vest_viz/instrument/teeth.h"

namespace vest::displays {
namespace {

void place(Ogre::SceneNode* node, const Eigen::Isometry3d& X) {
  const Eigen::Quaterniond q(X.linear());
  node->setPosition(static_cast<float>(X.translation().x()), static_cast<float>(X.translation().y()),
                    static_cast<float>(X.translation().z()));
  node->setOrientation(static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                       static_cast<float>(q.z()));
}

/// Teeth lie in each other's shadow (make_meshes.cpp cuts them up to 0.35 mm deep): the lamp is mirrored less
/// there. One shade for crests and grooves: shades of their own sparkle, dot by dot, in pixels of their size.
std::vector<float> toothShade(const instrument::TriangleMesh& toothless) {
  constexpr float kTeeth = 0.0010f, kMiddle = 0.00018f;  // m from where jaws meet: their reach, half a tooth
  std::vector<float> tint(toothless.positions.size() / 3 * 4, 1.0f);
  for (std::size_t v = 0; 4 * v < tint.size(); ++v)
    tint[4 * v + 3] = std::clamp(std::fabs(toothless.positions[3 * v]), kMiddle, kTeeth) / kTeeth;
  return tint;
}

}  // namespace

InstrumentVisual::InstrumentVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, bool depth_in_alpha)
    : manager_(manager), node_(parent->createChildSceneNode()), depth_in_alpha_(depth_in_alpha) {
  X_WSlot_.fill(Eigen::Isometry3d::Identity());
  slot_nodes_[0] = node_;
  slot_nodes_[1] = node_->createChildSceneNode();
  slot_nodes_[2] = node_->createChildSceneNode();
}

InstrumentVisual::~InstrumentVisual() {
  clear();
  for (std::size_t i : {std::size_t{2}, std::size_t{1}}) {
    node_->removeChild(slot_nodes_[i]);
    manager_->destroySceneNode(slot_nodes_[i]);
  }
  node_->getParentSceneNode()->removeChild(node_);
  manager_->destroySceneNode(node_);
}

void InstrumentVisual::clear() {
  for (auto& slot : slots_) {
    for (Part& part : slot) {
      part.mesh.reset();
      drop(part.material);
    }
    slot.clear();
  }
}

void InstrumentVisual::add(int slot, const instrument::TriangleMesh& mesh, Surface surface) {
  Part part;
  part.gauze = surface == Surface::Gauze;
  part.material = cloneMaterial(part.gauze ? "vest_viz/Gauze" : "vest_viz/Metal");
  if (warning_.empty()) warning_ = unsupported(part.material);
  Ogre::Pass* pass = part.material->getTechnique(0)->getPass(0);
  if (pass->hasFragmentProgram()) {
    const auto parameters = pass->getFragmentProgramParameters();
    if (!part.gauze)
      parameters->setNamedConstant("metal", surface == Surface::Insulation
                                                ? Ogre::Vector4(0.20f, 0.75f, 0.6f, 0.0f)
                                                : Ogre::Vector4(0.55f, 0.25f, 0.0f, 0.0f));
    parameters->setNamedConstant("depth_in_alpha", depth_in_alpha_ ? 1.0f : 0.0f);
  }
  part.triangles = mesh;
  const auto s = static_cast<std::size_t>(slot);
  part.mesh =
      std::make_unique<DynamicMesh>(manager_, slot_nodes_[s], part.material, Ogre::RENDER_QUEUE_MAIN - 5);
  const bool teeth = slot != 0 && tool_ != static_cast<int>(tools::ToolKind::Scissors);
  if (teeth) part.toothless = instrument::toothless(mesh);
  part.mesh->setShape(mesh.triangles, {}, teeth ? toothShade(part.toothless) : std::vector<float>(),
                      mesh.positions.size() / 3);
  part.mesh->setVertices(mesh.positions, mesh.normals, {});
  slots_[s].push_back(std::move(part));
}

void InstrumentVisual::setTool(int tool) {
  if (tool == tool_) return;
  clear();
  tool_ = tool;
  teeth_ = 1;
  warning_.clear();
  if (tool <= 0 || tool >= tools::kToolKindCount) return;
  const tools::ToolGeometry& geometry = tools::toolGeometry(static_cast<tools::ToolKind>(tool));
  jaw_length_ = geometry.jaw_length;
  shaft_radius_ = geometry.shaft_radius;
  const std::string stem = ros::package::getPath("vest_instruments") + "/meshes/" +
                           std::string(tools::toolName(static_cast<tools::ToolKind>(tool)));
  struct File {
    const char* part;
    int slot;
    Surface surface;
  };
  const Surface fixed = tool == static_cast<int>(tools::ToolKind::Swab) ? Surface::Gauze : Surface::Steel;
  constexpr double kCrease = 0.6;  // rad: cylinders smooth, edges of blades sharp
  bool shaft = false;
  for (const File& file : {File{"_shaft", 0, Surface::Insulation}, File{"_fixed", 0, fixed},
                           File{"_jaw_left", 1, Surface::Steel}, File{"_jaw_right", 2, Surface::Steel}}) {
    const std::string path = stem + file.part + ".stl";
    if (!std::ifstream(path)) continue;
    try {
      add(file.slot, instrument::readStl(path, kCrease), file.surface);
      shaft = shaft || file.slot == 0;
    } catch (const std::exception& e) {
      warning_ = e.what();
    }
  }
  if (shaft) return;
  if (warning_.empty()) warning_ = stem + "_shaft.stl is missing, capsules are shown";
  add(0, instrument::capsule(geometry.shaft_radius, -0.3, -jaw_length_), Surface::Insulation);
  if (jaw_length_ > 0)
    for (int side : {1, 2}) add(side, instrument::capsule(0.0012, 0.0, jaw_length_ - 0.0012), Surface::Steel);
}

void InstrumentVisual::setPose(const Eigen::Isometry3d& X_WTip, double jaw) {
  place(node_, X_WTip);
  X_WSlot_[0] = X_WTip;
  opening_ = jaw;
  for (int side : {1, 2}) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.translation().z() = -jaw_length_;
    X.rotate(Eigen::AngleAxisd((side == 1 ? 0.5 : -0.5) * jaw, Eigen::Vector3d::UnitY()));
    place(slot_nodes_[static_cast<std::size_t>(side)], X);
    X_WSlot_[static_cast<std::size_t>(side)] = X_WTip * X;
  }
}

bool InstrumentVisual::shaft(Eigen::Vector3d* from, Eigen::Vector3d* to, double* radius) const {
  constexpr double kLength = 0.12;  // m: farther out it is near no tissue
  *from = X_WSlot_[0] * Eigen::Vector3d(0, 0, -0.5 * jaw_length_);
  *to = X_WSlot_[0] * Eigen::Vector3d(0, 0, -kLength);
  *radius = shaft_radius_;
  return visible_ && !slots_[0].empty();
}

bool InstrumentVisual::jaws(instrument::Jaws* jaws) const {
  *jaws = {X_WSlot_[0], opening_, jaw_length_};
  return visible_ && jaw_length_ > 0;
}

void InstrumentVisual::setLight(const Ogre::Vector4& light) {
  for (auto& slot : slots_)
    for (Part& part : slot) {
      Ogre::Pass* pass = part.material->getTechnique(0)->getPass(0);
      if (pass->hasFragmentProgram()) pass->getFragmentProgramParameters()->setNamedConstant("light", light);
    }
}

void InstrumentVisual::setDetail(const Eigen::Vector3d& camera, double pixels) {
  constexpr float kStep = 1.0f / 16;  // a move of less than 12 um
  const double distance = (X_WSlot_[1] * Eigen::Vector3d(0, 0, 0.5 * jaw_length_) - camera).norm();
  const float teeth = kStep * std::round(instrument::teethShown(distance / pixels) / kStep);
  if (teeth == teeth_) return;
  teeth_ = teeth;
  for (auto& slot : slots_)
    for (Part& part : slot) {
      if (part.toothless.positions.empty()) continue;
      const instrument::TriangleMesh shown = instrument::between(part.toothless, part.triangles, teeth);
      part.mesh->setVertices(shown.positions, shown.normals, {});
    }
}

void InstrumentVisual::setSoaked(float full, float blood) {
  for (Part& part : slots_[0]) {
    if (!part.gauze) continue;
    Ogre::Pass* pass = part.material->getTechnique(0)->getPass(0);
    if (pass->hasFragmentProgram())
      pass->getFragmentProgramParameters()->setNamedConstant("soak", Ogre::Vector4(full, blood, 0, 0));
  }
}

instrument::TriangleMesh InstrumentVisual::worldMesh() const {
  instrument::TriangleMesh all;
  for (std::size_t s = 0; s < slots_.size(); ++s)
    for (const Part& part : slots_[s]) effects::append(&all, part.triangles, X_WSlot_[s]);
  return all;
}

void InstrumentVisual::setVisible(bool visible) {
  visible_ = visible;
  node_->setVisible(visible, true);
}

}  // namespace vest::displays

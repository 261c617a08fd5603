#include <algorithm>
#include <cmath>

#include "vest_bringup/learning/environment.h"
#include "vest_tissue/interaction/tool_state.h"

namespace vest::learning {
namespace {

constexpr double kFieldOfView = 1.2217;  // rad: 70°, as the endoscopic view's
constexpr Painter::Colour kSteel{176, 182, 190}, kWall{150, 84, 76}, kOrgan{214, 120, 112},
    kVessel{196, 70, 66}, kThread{120, 70, 170};
constexpr double kWater[] = {120, 150, 160}, kBlood[] = {120, 8, 10};
constexpr float kShallow = 0.0005f;  // m: shallower pools are not drawn

Painter::Colour colourOf(const scene::Object& object) {
  if (object.model == scene::ObjectModel::Rigid) return kWall;
  const bool vessel = object.organ.find("vessel") != std::string::npos ||
                      object.organ.find("arter") != std::string::npos ||
                      object.organ.find("vein") != std::string::npos;
  return vessel ? kVessel : kOrgan;
}

}  // namespace

void Environment::draw(const Eigen::Isometry3d& camera, const std::vector<scene::ToolInput>& tools, int width,
                       int height, std::uint8_t* rgb, float* depth) {
  painter_.begin(camera, kFieldOfView, width, height, rgb, depth);
  for (std::size_t o = 0; o < world().objectCount(); ++o) {
    xyz_.resize(3 * world().knotCount(o));
    world().positions(o, xyz_.data());
    painter_.mesh(xyz_, world().contactTriangles(o), world().contactTriangleAlive(o),
                  colourOf(world().description().objects[o]));
  }
  const auto instrument = [this](const scene::ToolInput& tool) {
    if (!tool.present || tool.tool == tools::ToolKind::Endoscope) return;
    interaction::ToolPose pose;
    pose.tip = tool.position, pose.orientation = tool.orientation, pose.pivot = tool.pivot,
    pose.jaw = tool.jaw;
    std::array<interaction::PlacedCapsule, interaction::kMaxToolCapsules> capsules;
    const int count = interaction::placeCapsules(tools::toolGeometry(tool.tool), pose, capsules.data());
    for (int k = 0; k < count; ++k) {
      const auto& c = capsules[static_cast<std::size_t>(k)];
      painter_.rod(c.a, c.b, c.radius, kSteel);
    }
  };
  for (const scene::ToolInput& tool : tools) instrument(tool);
  world().threads(threads_);
  for (const scene::ThreadView& t : threads_)
    for (std::size_t k = 1; k < t.positions.size(); ++k)
      painter_.rod(t.positions[k - 1], t.positions[k],
                   world().description().sutures[t.suture].rod.section.radius, kThread);
  world().needles(needles_);
  for (const scene::NeedleView& n : needles_)
    for (std::size_t k = 1; k < n.positions.size(); ++k)
      painter_.rod(n.positions[k - 1], n.positions[k], n.radius, kSteel);
  if (stage_.field) drawPools();
}

/// The level of the wet cells, in the colour of what stands there.
void Environment::drawPools() {
  const fluid::Model& model = stage_.field->fluidModel();
  const fluid::Pools& pools = stage_.field->fluid().pools;
  const auto size = static_cast<float>(model.parameters.pool_cell);
  const int columns = model.columns, rows = model.rows;
  const auto cell = [&](int c, int r) { return static_cast<std::size_t>(r * columns + c); };
  const auto wet = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < columns && r < rows && pools.depth[cell(c, r)] >= kShallow;
  };
  // A corner lies between the levels of the wet cells around it: neighbours meet.
  const auto corner = [&](int c, int r) {
    float sum = 0;
    int count = 0;
    for (const int j : {r - 1, r})
      for (const int i : {c - 1, c})
        if (wet(i, j)) sum += pools.top(cell(i, j)), ++count;
    xyz_.insert(xyz_.end(), {static_cast<float>(model.parameters.low[0]) + static_cast<float>(c) * size,
                             static_cast<float>(model.parameters.low[1]) + static_cast<float>(r) * size,
                             sum / static_cast<float>(count)});
  };
  static const std::vector<std::array<std::uint32_t, 3>> kSquare{{0, 1, 2}, {0, 2, 3}};
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      if (!wet(c, r)) continue;
      xyz_.clear();
      corner(c, r), corner(c + 1, r), corner(c + 1, r + 1), corner(c, r + 1);
      const double share =
          std::clamp(static_cast<double>(pools.blood[cell(c, r)] / pools.depth[cell(c, r)]), 0.0, 1.0);
      Painter::Colour colour;
      for (std::size_t k = 0; k < 3; ++k)
        colour[k] = static_cast<std::uint8_t>(kWater[k] + std::sqrt(share) * (kBlood[k] - kWater[k]));
      painter_.mesh(xyz_, kSquare, {}, colour);
    }
}

void Environments::pictures(int width, int height, std::uint8_t* rgb, float* depth) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  auto work = [&](std::size_t i) {
    all_[i]->picture(width, height, rgb + 3 * i * pixels, depth + i * pixels);
  };
  pool_.each(all_.size(), work);
}

}  // namespace vest::learning

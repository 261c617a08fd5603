#include "step_input.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "vest_tissue/scene/request.h"

namespace vest::learning {
namespace {

[[noreturn]] void refuse(const std::string& field, const std::string& value, const std::string& allowed) {
  throw std::invalid_argument("input: " + field + ": " + value + " (allowed: " + allowed + ")");
}

template <std::size_t N>
Eigen::Vector3d vec(const double (&v)[N], const char* field) {
  for (const double x : v)
    if (!std::isfinite(x)) refuse(field, std::to_string(x), "finite numbers");
  return {v[0], v[1], v[2]};
}

const char* text(const char* text, const char* field) {
  if (!text) refuse(field, "NULL", "a text");
  return text;
}

/// @param each called with an item's index
template <class T, class Each>
void all(const T* items, std::size_t count, const char* field, Each each) {
  if (count > 0 && !items) refuse(field, "NULL", "as many as are counted");
  if (count > 1000000) refuse(field, std::to_string(count), "at most 1000000");
  for (std::size_t i = 0; i < count; ++i) each(items[i]);
}

scene::ToolInput tool(const vest_tool& from) {
  if (from.tool < 0 || from.tool >= tools::kToolKindCount)
    refuse("tool", std::to_string(from.tool), "0 to " + std::to_string(tools::kToolKindCount - 1));
  scene::ToolInput to;
  to.present = from.present != 0;
  to.tool = static_cast<tools::ToolKind>(from.tool);
  to.functions = from.functions;
  to.position = vec(from.position, "position"), to.pivot = vec(from.pivot, "pivot");
  to.sight = vec(from.sight, "sight");
  vec(from.orientation, "orientation");
  to.orientation =
      Eigen::Quaterniond(from.orientation[3], from.orientation[0], from.orientation[1], from.orientation[2]);
  if (!std::isfinite(from.jaw)) refuse("jaw", std::to_string(from.jaw), "a finite number");
  to.jaw = from.jaw;
  return to;
}

}  // namespace

void read(const vest_input& from, const scene::World& world, scene::StepInput& to) {
  const std::uint64_t next = world.steps() + 1;
  if (from.step != 0 && from.step != next)
    refuse("step", std::to_string(from.step), std::to_string(next) + ", or 0 for the next one");
  to.step = next;
  to.dt = from.dt == 0 ? world.description().dt : from.dt;
  if (!(to.dt >= 1e-6 && to.dt <= 0.01)) refuse("dt", std::to_string(from.dt) + " s", "1e-6 to 0.01");
  to.seed = from.seed;
  for (std::size_t i = 0; i < to.tools.size(); ++i) to.tools[i] = tool(from.tools[i]);
  const auto object = [&](std::uint32_t index, const char* field) {
    if (index >= world.objectCount())
      refuse(field, "object " + std::to_string(index), "0 to " + std::to_string(world.objectCount() - 1));
    return static_cast<std::uint16_t>(index);
  };
  to.edits.clear(), to.impacts.clear(), to.loads.clear(), to.dilatations.clear(), to.requests.clear();
  all(from.edits, from.edit_count, "edits", [&](const vest_edit& e) {
    to.edits.push_back({text(e.object, "edits: object"), text(e.parameter, "edits: parameter"), e.value});
  });
  all(from.impacts, from.impact_count, "impacts", [&](const vest_impact& m) {
    to.impacts.push_back({object(m.object, "impacts"),
                          m.triangle,
                          {m.weights[0], m.weights[1], m.weights[2]},
                          vec(m.momentum, "impacts: momentum")});
  });
  all(from.loads, from.load_count, "loads", [&](const vest_load& m) {
    to.loads.push_back({object(m.object, "loads"),
                        m.knot,
                        {m.force[0], m.force[1], m.force[2]},
                        m.damping,
                        m.stiffness,
                        m.depth});
  });
  to.load_over = from.load_over;
  if (!(from.sunk >= 0 && from.sunk <= 1)) refuse("sunk", std::to_string(from.sunk) + " m", "0 to 1");
  to.sunk = from.sunk;
  all(from.dilatations, from.dilatation_count, "dilatations", [&](const vest_dilatation& d) {
    scene::DilatationInput& taken = to.dilatations.emplace_back();
    static_assert(sizeof d.dilatation == sizeof taken.dilatation);
    taken.vessel_segment = text(d.vessel_segment, "dilatations: vessel_segment");
    std::copy(std::begin(d.dilatation), std::end(d.dilatation), taken.dilatation.begin());
  });
  all(from.requests, from.request_count, "requests", [&](const char* r) {
    to.requests.push_back(scene::parseRequest(text(r, "requests"), world.description()));
  });
}

}  // namespace vest::learning

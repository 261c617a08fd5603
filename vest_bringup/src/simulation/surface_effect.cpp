#include "vest_bringup/simulation/surface_effect.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "vest_effects/state_bytes.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::simulation {

namespace {

constexpr std::uint16_t kSlot = 64;         // of the fluid source; vessels' openings have lower ones
constexpr double kRunoffArea = 1e-5;        // m²: blood creeps off over some square millimetres (assumed)
constexpr double kGreatestBleeding = 1000;  // of the scale, no unit
constexpr double kCutReach = 0.0025;        // m around a cut whose capillaries are open (assumed)
constexpr double kPunctureReach = 0.0015;   // m (assumed)
constexpr double kPress = 0.5;              // N from which on a tool presses (assumed)

/// Room that a World keeps for copies of knots (World::Impl::reserve).
std::size_t roomFor(std::size_t knots) {
  return knots + knots / 4 + 64;
}

bleeding::SurfaceModel build(const scene::World& world) {
  bleeding::SurfaceModel m;
  m.first.push_back(0);
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const scene::Object& o = world.description().objects[i];
    const std::size_t first = m.first.back(), knots = o.rest_position.size();
    const bool bleeds = world.model().objects[i].net && o.organ != "artery" && o.organ != "vein";
    m.area.resize(first + roomFor(knots), 0.0);
    m.supply.resize(first + roomFor(knots), 0.0);
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : o.contact_triangles) {
      if (!bleeds) break;
      const Eigen::Vector3d a = o.rest_position[t[0]], b = o.rest_position[t[1]], c = o.rest_position[t[2]];
      const double area = 0.5 * std::sqrt((b - a).cross(c - a).squaredNorm());
      for (int e = 0; e < 3; ++e) {
        m.area[first + t[e]] += area / 3;
        edges.insert(std::minmax(t[e], t[(e + 1) % 3]));
      }
    }
    for (const auto& [a, b] : edges) {
      m.link0.push_back(static_cast<std::uint32_t>(first + a));
      m.link1.push_back(static_cast<std::uint32_t>(first + b));
    }
    double area = 0, supply = 0;
    std::size_t outer = 0;
    const double per_kg = bleeding::supplyOf(o.organ.c_str());
    for (std::size_t k = 0; k < knots && bleeds; ++k) {
      if (!(m.area[first + k] > 0)) continue;
      m.supply[first + k] = per_kg * o.mass[k];
      area += m.area[first + k], supply += m.supply[first + k];
      ++outer;
    }
    // Copies that a cut makes: the object's mean.
    for (std::size_t k = knots; k < roomFor(knots) && outer > 0; ++k) {
      m.area[first + k] = area / static_cast<double>(outer);
      m.supply[first + k] = supply / static_cast<double>(outer);
    }
    m.scene.push_back(static_cast<std::uint32_t>(knots));
    m.first.push_back(static_cast<std::uint32_t>(first + roomFor(knots)));
  }
  return m;
}

}  // namespace

SurfaceEffect::SurfaceEffect(const scene::World& world, const SurfaceOptions& options, BloodEffect* blood,
                             scene::TripleBuffer<SurfaceFrame>* frames)
    : options_(options), blood_(blood), model_(build(world)), frames_(frames) {
  const auto refuse = [](const char* name, double value, const char* allowed) {
    throw std::invalid_argument(std::string(name) + ": " + std::to_string(value) + " (allowed: " + allowed +
                                ")");
  };
  if (!(options.scale >= 0 && options.scale <= kGreatestBleeding))
    refuse("surface_bleeding", options.scale, "0 to 1000");
  if (!(options.frame_rate >= 1 && options.frame_rate <= 100))
    refuse("surface_rate", options.frame_rate, "1 to 100 Hz");
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const std::string& organ = world.description().objects[i].organ;
    vessel_.push_back(organ == "artery" || organ == "vein");
    positions_.emplace_back(3 * roomFor(model_.scene[i]));
    rows_.push_back(nullptr);
  }
  for (std::size_t i = 0; i < world.objectCount(); ++i)
    if (world.model().objects[i].net) rows_[i] = positions_[i].data();
  inputs_.positions = rows_.data();
  if (frames_) {
    frames_->forEachSlot(
        [&](SurfaceFrame& f) { f.flow.reserve(model_.knots()), f.wetness.reserve(model_.knots()); });
  }
  frame_every_ = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(1 / (options.frame_rate * world.description().dt) + 0.5));
  reset();
}

void SurfaceEffect::reset() {
  state_ = bleeding::initialSurface(model_);
  scale_ = options_.scale;
}

void SurfaceEffect::save(std::vector<std::uint8_t>& bytes) const {
  effects::StateWriter writer(bytes);
  double scale = scale_;
  walk(writer, state_, scale);
}

bool SurfaceEffect::restore(const std::uint8_t* bytes, std::size_t count) {
  if (count == 0) {
    reset();
    return true;
  }
  bleeding::SurfaceState state = state_;
  double scale = scale_;
  effects::StateReader reader(bytes, count);
  walk(reader, state, scale);
  if (!reader.done()) return false;
  std::fill(state.dry.begin(), state.dry.end(), std::uint8_t{0});
  state_ = state;
  scale_ = scale;
  return true;
}

/// Copies that cuts have made since, and where knots are, where anything bleeds or happens.
void SurfaceEffect::follow(const scene::World& world, const std::vector<scene::Event>& events) {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_[i]) continue;
    const auto& doubled = world.topology(i).doubled_knots;
    while (state_.used[i] < model_.scene[i] + doubled.size())
      bleeding::copyKnot(model_, i, doubled[state_.used[i] - model_.scene[i]], state_);
    const bool happens = std::any_of(events.begin(), events.end(), [i](const auto& e) { return e.object == i; });
    if (state_.dry[i] && !happens) continue;
    if (world.knotCount(i) * 3 <= positions_[i].size()) world.positions(i, positions_[i].data());
  }
}

void SurfaceEffect::take(const scene::Event& event) {
  if (event.object >= vessel_.size() || vessel_[event.object] || !rows_[event.object]) return;
  using scene::EventKind;
  const float* xyz = rows_[event.object];
  switch (event.kind) {
    case EventKind::Cut:
    case EventKind::Torn:
      bleeding::openSurface(model_, event.object, xyz, event.position, kCutReach, state_);
      break;
    case EventKind::Punctured:
    case EventKind::Perforated:
      bleeding::openSurface(model_, event.object, xyz, event.position, kPunctureReach, state_);
      break;
    case EventKind::Coagulated:
      if (std::isfinite(event.energy) && event.energy > 0)
        bleeding::sealSurface(model_, event.object, xyz, event.position, event.energy, state_);
      break;
    default:
      break;
  }
}

void SurfaceEffect::useTools(const scene::StepInput& input, const scene::StepReport& report) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const scene::ToolInput& tool = input.tools[static_cast<std::size_t>(t)];
    const scene::ContactModel& contact = report.contacts[static_cast<std::size_t>(t)];
    const bool fires = tool.present && (tool.functions & tools::kFunctionFire) != 0;
    const auto& points = tools::toolGeometry(tool.tool).interaction_points;
    const Eigen::Vector3d tip =
        contact.proxy * (points.empty() ? Eigen::Vector3d::Zero().eval() : points.front());
    inputs_.inject[t] = {fires && contact.in_contact && tool.tool == tools::ToolKind::InjectionNeedle, tip};
    inputs_.press[t] = {contact.in_contact && contact.wrench.head<3>().squaredNorm() > kPress * kPress, tip};
  }
}

void SurfaceEffect::wash(std::size_t object, const std::array<std::uint32_t, 3>& knots, double impulse) {
  if (object < rows_.size() && rows_[object])
    bleeding::washSurface(model_, object, rows_[object], knots, impulse, state_);
}

void SurfaceEffect::edits(const scene::World&, std::vector<scene::EditableParameter>& out) const {
  out.push_back({"", "surface_bleeding", "", 0.0, kGreatestBleeding});
}

void SurfaceEffect::step(const scene::World& world, const scene::StepInput& input,
                         const scene::StepReport& report, Feedback& feedback) {
  for (const auto& edit : input.edits) {
    if (edit.object.empty() && edit.parameter == "surface_bleeding" && std::isfinite(edit.value))
      scale_ = std::clamp(edit.value, 0.0, kGreatestBleeding);
  }
  if (state_.active || !report.events.empty()) follow(world, report.events);
  for (const auto& event : report.events) take(event);
  if (state_.active) {
    useTools(input, report);
    inputs_.scale = scale_;
    inputs_.pressure_ratio =
        blood_
            ? std::clamp(blood_->circulation().smoothed_pressure / blood_->model().resting_pressure, 0.0, 3.0)
            : 1.0;
    const double dt = std::isfinite(input.dt) ? std::clamp(input.dt, 0.0, 0.01) : 0.0;
    const double before = state_.seeped;
    bleeding::SurfaceRunoff runoff;
    bleeding::stepSurface(model_, inputs_, dt, state_, &runoff);
    if (blood_) blood_->lose(state_.seeped - before);
    if (runoff.volume > 0 && dt > 0 && feedback.sources.size() < feedback.sources.capacity()) {
      bleeding::FluidSource source;
      source.slot = kSlot;
      source.object = runoff.object;
      source.position = runoff.place;
      source.area = kRunoffArea;
      source.flow = runoff.volume / dt;
      feedback.sources.push_back(source);
    }
  }
  if (frames_ && world.steps() % frame_every_ == 0) tellFrame(world);
}

void SurfaceEffect::tellFrame(const scene::World& world) {
  SurfaceFrame& f = frames_->back();
  f.step = world.steps();
  f.revision = world.revision();
  f.seeped = state_.seeped;
  f.film = state_.active ? bleeding::filmVolume(model_, state_) : 0.0;
  f.flow.clear(), f.wetness.clear();
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const std::uint32_t room = model_.first[i + 1] - model_.first[i];
    for (std::uint32_t k = 0; k < world.knotCount(i); ++k) {
      const bool known = k < room;
      f.flow.push_back(known ? state_.flow[model_.first[i] + k] : 0.0f);
      f.wetness.push_back(known ? bleeding::wetness(state_.film[model_.first[i] + k]) : 0.0f);
    }
  }
  frames_->publish();
}

}  // namespace vest::simulation

#include "vest_bringup/simulation/surface_effect.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "field_parts.h"
#include "vest_effects/bleeding/swab.h"
#include "vest_effects/state_bytes.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_tissue/scene/cavity_walls.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/solver/pool.h"

namespace vest::simulation {

namespace {

constexpr std::uint16_t kFirstSlot = 64;  // of the fluid sources; vessels' openings have lower ones
static_assert(kFirstSlot + bleeding::kMostDrips <= bleeding::kMostSources &&
              kFirstSlot >= bleeding::kMostOpenings);
constexpr std::uint64_t kEvery = 8;          // steps of the tissue
constexpr std::uint64_t kPerfuseEvery = 40;  // of the same: blanching takes seconds
constexpr std::uint32_t kUnseen = ~0u;       // revision of a topology that was not looked at
constexpr double kRunoffArea = 1e-5;         // m²: blood creeps off over some square millimetres (assumed)
constexpr double kGreatestBleeding = 1000;   // of the scale, no unit
constexpr double kCutReach = 0.0025;         // m around a cut whose capillaries are open (assumed)
constexpr double kPunctureReach = 0.0015;    // m (assumed)
constexpr double kPress = 0.5;               // N from which on a tool presses (assumed)

/// Room that a World keeps for copies of knots (World::Impl::reserve).
std::size_t roomFor(std::size_t knots) {
  return knots + knots / 4 + 64;
}

bool bleeds(const scene::World& world, std::size_t object) {
  const std::string& organ = world.description().objects[object].organ;
  return world.model().objects[object].deforms && organ != "artery" && organ != "vein";
}

bleeding::SurfaceModel build(const scene::World& world) {
  bleeding::SurfaceModel m;
  m.first.push_back(0);
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const scene::Object& o = world.description().objects[i];
    const std::size_t first = m.first.back(), knots = world.knotCount(i), room = roomFor(knots);
    m.perfusion.resize(first + room, bleeds(world, i) ? o.thermal.perfusion : 0.0);
    if (bleeds(world, i))
      std::copy_n(o.knot_perfusion.begin(), std::min(knots, o.knot_perfusion.size()),
                  m.perfusion.begin() + static_cast<std::ptrdiff_t>(first));
    m.depth.resize(first + room, bleeding::kFeedDepth);
    if (world.model().objects[i].deforms && !o.fem && o.density > 0) {
      // A shell bleeds from what it has behind its surface.
      std::vector<double> area(knots, 0.0);
      for (const auto& t : o.contact_triangles) {
        const Eigen::Vector3d a = o.rest_position[t[0]];
        const double third =
            std::sqrt((o.rest_position[t[1]] - a).cross(o.rest_position[t[2]] - a).squaredNorm()) / 6;
        for (const auto k : t) area[k] += third;
      }
      double volume = 0, whole = 0;
      for (std::size_t k = 0; k < knots; ++k) {
        if (!(area[k] > 0)) continue;
        m.depth[first + k] = std::min(bleeding::kFeedDepth, o.mass[k] / (o.density * area[k]));
        volume += m.depth[first + k] * area[k], whole += area[k];
      }
      for (std::size_t k = knots; k < room && whole > 0; ++k) m.depth[first + k] = volume / whole;
    }
    m.scene.push_back(static_cast<std::uint32_t>(knots));
    m.first.push_back(static_cast<std::uint32_t>(first + room));
  }
  return m;
}

}  // namespace

SurfaceEffect::SurfaceEffect(const scene::World& world, const SurfaceOptions& options, BloodEffect* blood,
                             scene::TripleBuffer<SurfaceFrame>* frames)
    : options_(options), blood_(blood), model_(build(world)), supply_(world, model_.first), frames_(frames) {
  const auto refuse = [](const char* name, double value, const char* allowed) {
    throw std::invalid_argument(std::string(name) + ": " + std::to_string(value) + " (allowed: " + allowed +
                                ")");
  };
  if (!(options.scale >= 0 && options.scale <= kGreatestBleeding))
    refuse("surface_bleeding", options.scale, "0 to 1000");
  if (!(options.frame_rate >= 1 && options.frame_rate <= 100))
    refuse("surface_rate", options.frame_rate, "1 to 100 Hz");
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const scene::Object& o = world.description().objects[i];
    positions_.emplace_back(3 * roomFor(model_.scene[i]));
    rest_.emplace_back(3 * roomFor(model_.scene[i]));
    for (std::size_t k = 0; k < std::min<std::size_t>(o.rest_position.size(), model_.scene[i]); ++k)
      for (std::size_t a = 0; a < 3; ++a)
        rest_[i][3 * k + a] = static_cast<float>(o.rest_position[k][static_cast<int>(a)]);
    world.positions(i, positions_[i].data());
  }
  territory_.assign(world.objectCount(), -1);
  for (std::size_t i = 0; blood && i < territory_.size(); ++i) {
    const auto& territories = blood->model().vessels.territories;
    for (std::size_t k = 0; k < territories.size(); ++k)
      if (territories[k].tissue == world.description().objects[i].name) territory_[i] = static_cast<int>(k);
  }
  meshes_.resize(world.objectCount());
  hangs_.assign(world.objectCount(), 0);
  perfused_.assign(world.objectCount(), 1.0);
  drained_.assign(world.objectCount(), 1.0);
  seen_.assign(world.objectCount(), kUnseen);
  for (std::size_t i = 0; i < world.objectCount(); ++i)
    at_start_.push_back(static_cast<std::uint32_t>(world.contactTriangles(i).size()));
  inputs_.meshes = meshes_.data();
  inputs_.perfused = perfused_.data();
  if (frames_) {
    frames_->forEachSlot([&](SurfaceFrame& f) {
      f.flow.reserve(model_.knots()), f.wetness.reserve(model_.knots()), f.supply.reserve(model_.knots());
      f.oxygen.reserve(model_.knots()), f.set.reserve(model_.knots());
    });
  }
  frame_every_ = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(1 / (options.frame_rate * world.description().dt) + 0.5));
  reset();
}

void SurfaceEffect::reset() {
  state_ = bleeding::initialSurface(model_);
  perfusion_ = bleeding::initialPerfusion(model_.knots());
  supply_.reset();
  scale_ = options_.scale;
  faces_ = at_start_;
  std::fill(seen_.begin(), seen_.end(), kUnseen);
}

void SurfaceEffect::save(std::vector<std::uint8_t>& bytes) const {
  effects::StateWriter writer(bytes);
  double scale = scale_;
  walk(writer, state_, perfusion_, supply_.state, scale);
  writer(faces_);
}

void SurfaceEffect::adopt(const Effect& effect, const std::vector<std::uint32_t>& objects) {
  const auto* const before = dynamic_cast<const SurfaceEffect*>(&effect);
  if (before == nullptr) return;
  const bleeding::SurfaceState& from = before->state_;
  reset();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::uint32_t first = before->model_.first[i], room = before->model_.first[i + 1] - first;
    const std::uint32_t now = objects[i];
    if (now == scene::kNotAdopted) {
      for (std::uint32_t k = first; k < first + room; ++k) state_.wiped += from.film[k] + from.loose[k];
      continue;
    }
    const auto take = [&](const auto& all, auto& into) {
      std::copy_n(all.begin() + first, room, into.begin() + model_.first[now]);
    };
    take(from.open, state_.open), take(from.sealed, state_.sealed), take(from.clot, state_.clot);
    take(from.drug, state_.drug), take(from.styptic, state_.styptic), take(from.area, state_.area);
    take(from.film, state_.film), take(from.age, state_.age), take(from.loose, state_.loose);
    take(from.flow, state_.flow);
    take(before->perfusion_.reach, perfusion_.reach);
    take(before->perfusion_.saturation, perfusion_.saturation);
    take(before->perfusion_.dilation, perfusion_.dilation);
    state_.used[now] = from.used[i];
    faces_[now] = before->faces_[i];
  }
  state_.injected = from.injected, state_.depot = from.depot;
  for (std::size_t d = 0; d < from.drips.size(); ++d) {
    const bleeding::Drip& drip = from.drips[d];
    if (drip.object < 0 || objects[static_cast<std::size_t>(drip.object)] == scene::kNotAdopted) continue;
    state_.drips[d] = drip;
    state_.drips[d].object = static_cast<std::int32_t>(objects[static_cast<std::size_t>(drip.object)]);
  }
  state_.seeped = from.seeped, state_.stained = from.stained, state_.shed = from.shed;
  state_.wiped += from.wiped;
  state_.active = from.active;
  std::fill(state_.dry.begin(), state_.dry.end(), std::uint8_t{0});
  scale_ = before->scale_;
}

bool SurfaceEffect::restore(const std::uint8_t* bytes, std::size_t count) {
  if (count == 0) {
    reset();
    return true;
  }
  bleeding::SurfaceState state = state_;
  bleeding::PerfusionState perfusion = perfusion_;
  SupplyMap::State supply = supply_.state;
  double scale = scale_;
  effects::StateReader reader(bytes, count);
  walk(reader, state, perfusion, supply, scale);
  std::vector<std::uint32_t> faces = faces_;
  reader(faces);
  bool good = reader.done();
  for (const auto& drip : state.drips)
    good = good && drip.object >= -1 && drip.object < static_cast<std::int32_t>(seen_.size());
  for (std::size_t i = 0; good && i < seen_.size(); ++i) good = state.used[i] >= model_.scene[i];
  for (std::size_t k = 0; good && k < state.film.size(); ++k)
    good = state.film[k] >= 0 && state.loose[k] >= 0 && state.area[k] >= 0;
  for (std::size_t k = 0; good && k < perfusion.reach.size(); ++k)
    good = perfusion.reach[k] >= 0 && perfusion.saturation[k] >= 0 && perfusion.dilation[k] >= 0;
  if (!good) return false;
  std::fill(state.dry.begin(), state.dry.end(), std::uint8_t{0});
  std::fill(seen_.begin(), seen_.end(), kUnseen);
  state_ = state;
  perfusion_ = perfusion;
  supply_.state = supply;
  scale_ = scale;
  faces_ = faces;
  return true;
}

void SurfaceEffect::followCuts(const scene::World& world) {
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const scene::Topology& topology = world.topology(i);
    if (seen_[i] == topology.revision) continue;
    seen_[i] = topology.revision;
    const auto& doubled = topology.doubled_knots;
    const std::uint32_t scene = model_.scene[i], room = model_.first[i + 1] - model_.first[i];
    while (state_.used[i] < scene + doubled.size()) {
      const std::uint32_t from = doubled[state_.used[i] - scene], to = state_.used[i];
      bleeding::copyKnot(model_, i, from, state_);
      if (to < room && from < to)
        for (auto* v : {&perfusion_.reach, &perfusion_.saturation, &perfusion_.dilation})
          (*v)[model_.first[i] + to] = (*v)[model_.first[i] + from];
    }
    for (std::size_t k = 0; k < doubled.size() && scene + k < room; ++k) {
      std::copy_n(&rest_[i][3 * std::size_t{doubled[k]}], 3, &rest_[i][3 * (scene + k)]);
      model_.perfusion[model_.first[i] + scene + k] = model_.perfusion[model_.first[i] + doubled[k]];
    }
    const auto& triangles = world.contactTriangles(i);
    const auto& alive = world.contactTriangleAlive(i);
    meshes_[i] = {positions_[i].data(), triangles.data(),
                  alive.size() >= triangles.size() ? alive.data() : nullptr, triangles.size()};
    bleeding::measureSurface(model_, i, meshes_[i], rest_[i].data(), state_);
    // Of finite elements what came since are the faces that a cut made.
    for (std::size_t t = faces_[i]; t < triangles.size() && world.model().objects[i].fem; ++t)
      bleeding::openFace(model_, i, triangles[t], state_);
    faces_[i] = std::max(faces_[i], static_cast<std::uint32_t>(triangles.size()));
  }
}

/// Rigid objects stay where they were, but a cavity's wall that hangs.
void SurfaceEffect::findPositions(const scene::World& world, std::size_t object) {
  const scene::CavityWalls walls(world.model(), world.state(), sunk_);
  const bool hangs = walls.sink() && walls.isCavity(object),
             moves = world.model().objects[object].deforms || hangs || hangs_[object] != 0;
  if (!moves || 3 * world.knotCount(object) > positions_[object].size()) return;
  world.positions(object, positions_[object].data());
  if (hangs) walls.hang(object, positions_[object].data(), world.knotCount(object));
  hangs_[object] = hangs ? 1 : 0;
}

void SurfaceEffect::take(const scene::World& world, const scene::Event& event) {
  if (event.object >= meshes_.size() || !bleeds(world, event.object)) return;
  using scene::EventKind;
  const double reach = event.kind == EventKind::Cut || event.kind == EventKind::Torn ? kCutReach
                       : event.kind == EventKind::Punctured || event.kind == EventKind::Exited ||
                               event.kind == EventKind::Perforated
                           ? kPunctureReach
                           : 0;
  const bool heat = event.kind == EventKind::Coagulated && std::isfinite(event.energy) && event.energy > 0;
  if (!(reach > 0) && !heat) return;
  findPositions(world, event.object);
  const float* xyz = positions_[event.object].data();
  if (heat) {
    bleeding::sealSurface(model_, event.object, xyz, event.position, event.energy, state_);
  } else {
    bleeding::openSurface(model_, event.object, xyz, event.position, reach, state_);
  }
}

void SurfaceEffect::takeFilms(const scene::World& world, std::vector<FilmInput>& films) {
  for (const FilmInput& film : films) {
    if (film.object >= meshes_.size() || film.triangle >= world.contactTriangles(film.object).size()) {
      state_.wiped += film.blood;  // it went with its organ
      continue;
    }
    const auto& knots = world.contactTriangles(film.object)[film.triangle];
    bleeding::washSurface(model_, film.object, knots, film.impulse, state_);
    bleeding::stainSurface(model_, film.object, knots, film.blood, state_);
  }
  films.clear();
}

void SurfaceEffect::useTools(const scene::World& world, const scene::StepInput& input,
                             const scene::StepReport& report,
                             const std::array<double, tools::kInstrumentCount>& swab_room) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const scene::ToolInput& tool = input.tools[static_cast<std::size_t>(t)];
    const scene::ContactModel& contact = report.contacts[static_cast<std::size_t>(t)];
    const bool fires = tool.present && (tool.functions & tools::kFunctionFire) != 0;
    const auto& points = tools::toolGeometry(tool.tool).interaction_points;
    const Eigen::Vector3d tip =
        contact.proxy * (points.empty() ? Eigen::Vector3d::Zero().eval() : points.front());
    inputs_.inject[t] = {fires && contact.in_contact && tool.tool == tools::ToolKind::InjectionNeedle, tip,
                         -1};
    const bool gauze = tool.present && tool.tool == tools::ToolKind::Swab;
    inputs_.press[t] = {contact.in_contact && contact.wrench.head<3>().squaredNorm() > kPress * kPress, tip,
                        -1, gauze ? bleeding::kSwabReach : bleeding::kPressReach};
    const bool wipes = gauze && contact.in_contact;
    inputs_.gauze[t] = {tip, wipes ? swab_room[static_cast<std::size_t>(t)] : 0.0,
                        wipes ? bleeding::pressedRadius(pressing(contact), swabRadius()) : 0.0};
    inputs_.suck[t] = {tool.present && tool.tool == tools::ToolKind::SuctionIrrigator &&
                           (tool.functions & tools::kFunctionSuck) != 0,
                       tip, -1, bleeding::kSuckReach};
    if (!inputs_.inject[t].on) continue;
    // The needle is in the first object that it touches.
    for (const scene::ContactSide& side : world.state().sides)
      if (side.tool == t && inputs_.inject[t].object < 0) inputs_.inject[t].object = side.object;
    inputs_.inject[t].on = inputs_.inject[t].object >= 0;
    if (inputs_.inject[t].on) state_.dry[static_cast<std::size_t>(inputs_.inject[t].object)] = 0;
  }
}

/// By the vessels that feed it, or else as the arterial pressure goes.
double SurfaceEffect::perfused(std::size_t object) const {
  if (!blood_) return 1;
  if (territory_[object] >= 0)
    return haemodynamics::perfusion(blood_->model(), blood_->circulation(),
                                    static_cast<std::size_t>(territory_[object]));
  return std::clamp(blood_->circulation().smoothed_pressure / blood_->model().resting_pressure, 0.0, 3.0);
}

void SurfaceEffect::stepPerfusion(const scene::World& world, double dt) {
  supply_.follow(world);
  bleeding::stepPerfusion(
      {model_.first.data(), perfused_.size(), perfused_.data(), drained_.data(), supply_.fed().data()}, dt,
      perfusion_);
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
  const double dt = std::isfinite(input.dt) ? std::clamp(input.dt, 0.0, 0.01) : 0.0;
  sunk_ = input.sunk;
  followCuts(world);
  for (const auto& event : report.events) take(world, event);
  takeFilms(world, feedback.films);
  if (world.steps() % kEvery == 0) {
    useTools(world, input, report, feedback.swab_room);
    auto follow = [&](std::size_t i) {
      if (!state_.dry[i]) findPositions(world, i);
    };
    world.pool().each(meshes_.size(), follow);
    inputs_.scale = scale_;
    inputs_.drying = feedback.gas.drying;
    inputs_.reach = perfusion_.reach.data();
    inputs_.gravity = world.description().gravity;
    for (std::size_t i = 0; i < perfused_.size(); ++i) {
      perfused_[i] = perfused(i);
      drained_[i] =
          blood_ && territory_[i] >= 0 ? blood_->drained(static_cast<std::size_t>(territory_[i])) : 1.0;
    }
    if (world.steps() % kPerfuseEvery == 0) stepPerfusion(world, kPerfuseEvery * dt);
    const double before = state_.seeped;
    if (bleeding::seepSurface(model_, inputs_, kEvery * dt, state_, runoff_)) {
      auto run = [&](std::size_t i) {
        bleeding::runSurface(model_, inputs_, kEvery * dt, i, state_, runoff_);
      };
      world.pool().each(meshes_.size(), run);
      bleeding::dripSurface(model_, inputs_, state_, runoff_);
    }
    for (std::size_t t = 0; t < feedback.clots.size(); ++t) feedback.clots[t] += runoff_.clots[t];
    feedback.wiped = runoff_.wiped;
    if (blood_) blood_->lose(state_.seeped - before, kEvery * dt);
    for (std::size_t d = 0; d < runoff_.falls.size() && dt > 0; ++d) {
      const auto& fall = runoff_.falls[d];
      if (!(fall.volume > 0)) continue;
      bleeding::FluidSource source;
      source.slot = static_cast<std::uint16_t>(kFirstSlot + d);
      source.object = fall.object;
      source.position = fall.place;
      source.direction = inputs_.gravity;
      source.area = kRunoffArea;
      source.flow = fall.volume / dt;
      feedback.sources.push_back(source);
    }
  }
  feedback.blood_at_lens = state_.active ? bloodAt(world, tools::Instrument::Endoscope) : 0.0f;
  if (frames_ && world.steps() % frame_every_ == 0) tellFrame(world);
}

float SurfaceEffect::bloodAt(const scene::World& world, tools::Instrument tool) const {
  float most = 0;
  for (const scene::ContactSide& side : world.state().sides) {
    const auto& triangles = world.contactTriangles(side.object);
    if (side.tool != static_cast<std::uint8_t>(tool) || side.triangle >= triangles.size()) continue;
    for (const std::uint32_t k : triangles[side.triangle])
      if (model_.first[side.object] + k < model_.first[side.object + 1u])
        most = std::max(most, bleeding::wetness(bleeding::thickness(state_, model_.first[side.object] + k)));
  }
  return most;
}

void SurfaceEffect::tellFrame(const scene::World& world) {
  SurfaceFrame& f = frames_->back();
  f.step = world.steps();
  f.revision = world.revision();
  f.seeped = state_.seeped, f.wiped = state_.wiped;
  f.film = state_.active ? bleeding::filmVolume(state_) : 0.0;
  f.flow.clear(), f.wetness.clear(), f.supply.clear(), f.oxygen.clear(), f.set.clear();
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const std::uint32_t room = model_.first[i + 1] - model_.first[i];
    // The cavity's knots lie centimetres apart: shown between them, the film of one jet would redden all of
    // it.
    const bool shown = world.description().objects[i].model != scene::ObjectModel::Rigid;
    const bool living = bleeds(world, i);
    const auto brought = static_cast<float>(blood_ && territory_[i] >= 0 ? perfused_[i] : 1.0);
    for (std::uint32_t k = 0; k < world.knotCount(i); ++k) {
      const bool here = living && k < room, known = shown && k < room;
      const std::size_t n = model_.first[i] + (k < room ? k : 0);
      f.supply.push_back(here ? std::min(1.0f, brought * perfusion_.reach[n]) : 1.0f);
      f.oxygen.push_back(here ? perfusion_.saturation[n] : static_cast<float>(bleeding::kAtRest));
      f.set.push_back(known && state_.film[n] > 0 ? bleeding::setShare(state_.age[n]) : 0.0f);
      f.flow.push_back(known ? state_.flow[model_.first[i] + k] : 0.0f);
      f.wetness.push_back(known ? bleeding::wetness(bleeding::thickness(state_, model_.first[i] + k)) : 0.0f);
    }
  }
  frames_->publish();
}

}  // namespace vest::simulation

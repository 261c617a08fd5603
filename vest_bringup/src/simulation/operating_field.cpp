#include "vest_bringup/simulation/operating_field.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "field_impl.h"
#include "field_parts.h"
#include "vest_tissue/scene/cavity_walls.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"
#include "vest_tissue/solver/pool.h"

namespace vest::simulation {
namespace {

constexpr std::uint64_t kFluidEvery = 4, kSlowEvery = 20, kFrameEvery = 25,
                        kBedEvery = 48;  ///< steps of the tissue
constexpr int kInstrumentSlots = 128;    ///< first slot behind those of bleeding
constexpr double kLeastImpact = 0.15;    ///< m/s: slower than this fluid rests and weighs (fluid/impact.cpp)
constexpr double kFullBag = 4e4;         ///< Pa: at which the irrigator has its greatest flow (assumed)
constexpr double kValveTravel = 0.12;    ///< s: in which a thumb presses a trumpet valve down (assumed)
constexpr double kCaught = 0.3;          ///< share of what a sucker takes of clots that stays in it (assumed)
constexpr double kSideHoles = 0.5;       ///< share of the flow through them (assumed)
constexpr double kWithdrawn = 0.02;      ///< m from pivot to tip: the endoscope is in its trocar (assumed)

}  // namespace

scene::ImpactInput OperatingField::Impl::bounded(scene::ImpactInput impact, double speed,
                                                 const scene::World& world) {
  const scene::ObjectState& s = world.state().objects[impact.object];
  const float* const mass = s.block.row(net::Block::kMass);
  const double size = std::sqrt(impact.momentum.squaredNorm());
  for (std::size_t e = 0; size > 0 && e < 3; ++e) {
    const std::uint32_t knot = s.triangles[impact.triangle][e];
    float& had = gained[impact.object][knot];
    const double room = std::max(0.0, std::max(speed, kLeastImpact) - static_cast<double>(had));
    impact.weights[e] = std::min(impact.weights[e], room * static_cast<double>(mass[knot]) / size);
    had += static_cast<float>(impact.weights[e] * size / std::max(static_cast<double>(mass[knot]), 1e-12));
  }
  return impact;
}

double OperatingField::Impl::open(const scene::World& world, std::size_t tool) const {
  return (1 - between.clogged[tool] / kBore) * (world.state().grasps[tool].active ? kSideHoles : 1);
}

void OperatingField::Impl::gather(const scene::StepInput& input, const scene::StepReport& report,
                                  const Feedback& feedback) {
  for (const auto& e : input.edits) edit(e);
  for (const bleeding::FluidSource& from : feedback.sources) {
    if (from.slot >= kInstrumentSlots || !(from.flow > 0)) continue;
    fluid::Source& to = between.source[from.slot];
    const double volume = from.flow * input.dt;
    to.flow += volume;
    between.moment[from.slot] += volume * from.blood_fraction;
    to.position = triple(from.position), to.direction = triple(from.direction), to.area = from.area;
  }
  for (std::size_t t = 0; t < between.clogged.size(); ++t)
    between.clogged[t] = std::min(kBore, between.clogged[t] + kCaught * feedback.clots[t]);
  for (std::size_t t = 0; t < between.swab.size(); ++t)
    between.swab[t].volume += feedback.wiped[t], between.swab[t].blood += feedback.wiped[t];
  for (std::size_t t = 0; t < between.energy.size(); ++t) {
    if (!(report.heat[t].energy > 0)) continue;
    between.energy[t] += report.heat[t].energy;
    between.energy_place[t] = triple(report.heat[t].position);
  }
  const auto camera = static_cast<std::size_t>(tools::Instrument::Endoscope);
  if (report.contacts[camera].in_contact) {
    between.wiped = 1;
    between.wiped_on_blood = std::max(between.wiped_on_blood, feedback.blood_at_lens);
  }
}

/// m³ that a swab can still take as hard as it is pressed; < 0: what it gives back.
double OperatingField::Impl::swabRoom(std::size_t tool, const scene::StepReport& report) const {
  return between.swab[tool].room(bleeding::capacity(pressing(report.contacts[tool]), swabRadius()));
}

void OperatingField::Impl::stepFluid(const scene::World& world, const scene::StepInput& input,
                                     const scene::StepReport& report, Feedback& feedback) {
  fluid::Inputs& in = fluid_inputs;
  in.dt = input.dt * kFluidEvery;
  in.seed = input.seed;
  in.source_count = in.suction_count = 0;
  const Eigen::Vector3d gravity = world.description().gravity;
  in.gravity = triple(gravity);
  for (int slot = 0; slot < kInstrumentSlots; ++slot) {
    fluid::Source& s = between.source[static_cast<std::size_t>(slot)];
    if (!(s.flow > 0)) continue;
    fluid::Source& to = in.sources[static_cast<std::size_t>(in.source_count++)];
    to = s;
    to.slot = slot;
    to.blood = std::clamp(between.moment[static_cast<std::size_t>(slot)] / s.flow, 0.0, 1.0);
    to.flow = std::min(fluid::kGreatestFlow, s.flow / in.dt);
    to.area = std::clamp(s.area, 0.0, 0.01);
    s.flow -= to.flow * in.dt;  // what is more comes in the next steps
    if (s.flow < 1e-18) s.flow = 0;
    between.moment[static_cast<std::size_t>(slot)] = s.flow * to.blood;
  }
  std::array<int, tools::kInstrumentCount> gauze{};  // its suction's number
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const scene::ToolInput& tool = input.tools[t];
    const auto i = static_cast<std::size_t>(t);
    gauze[i] = -1;
    if (!tool.present || tool.tool != tools::ToolKind::Swab) {
      between.swab[i] = {};  // it went into the bin
    } else {
      const auto front =
          triple(tipOf(input, report, t) * tools::toolGeometry(tool.tool).interaction_points.front());
      const double room = swabRoom(i, report);
      if (room > 0) {
        gauze[i] = in.suction_count;
        fluid::Suction& s = in.suctions[static_cast<std::size_t>(in.suction_count++)];
        s = fluid::Suction{};
        s.position = front;
        s.flow = room / bleeding::kSwabTime;
        s.reach = s.capture = bleeding::kSwabReach;
        const scene::ContactModel& contact = report.contacts[i];
        s.patch = contact.in_contact ? bleeding::pressedRadius(pressing(contact), swabRadius()) : 0.0;
        s.soaks = true;
      } else if (room < 0) {
        bleeding::Swab& swab = between.swab[i];
        fluid::Source& s = in.sources[static_cast<std::size_t>(in.source_count++)];
        s = fluid::Source{};
        s.slot = kInstrumentSlots + t;
        s.position = front;
        s.direction = triple(gravity);
        s.area = 0;
        s.flow = std::min(fluid::kGreatestFlow, -room / bleeding::kSwabTime);
        s.blood = std::clamp(swab.blood / swab.volume, 0.0, 1.0);
        s.wrung = 1;
        swab.blood -= s.flow * in.dt * s.blood, swab.volume -= s.flow * in.dt;
      }
    }
    if (!tool.present || tool.tool != tools::ToolKind::SuctionIrrigator) {
      between.has_tip[i] = 0;
      between.valve[i] = {};
      between.clogged[i] = 0;
      continue;
    }
    const Eigen::Isometry3d tip = tipOf(input, report, t);
    const auto place = triple(tip.translation());
    auto& valve = between.valve[i];
    const auto press = [&](double& open, bool on) {
      open = std::clamp(open + (on ? 1 : -1) * in.dt / kValveTravel, 0.0, 1.0);
    };
    press(valve[0], (tool.functions & tools::kFunctionIrrigate) != 0);
    press(valve[1], (tool.functions & tools::kFunctionSuck) != 0);
    // Through an orifice, as the root of the pressure.
    const double drive = std::sqrt(std::max(0.0, between.bag_pressure - feedback.gas.pressure) / kFullBag);
    if (valve[0] > 0 && drive > 0) {
      fluid::Source& s = in.sources[static_cast<std::size_t>(in.source_count++)];
      s = fluid::Source{};
      s.slot = kInstrumentSlots + t;
      s.position = place;
      s.direction = triple(tip.linear().col(2));
      s.flow = std::min(fluid::kGreatestFlow, between.irrigation_flow * drive * valve[0]);
      s.area = 0.25 * 3.14159265358979 * options.irrigation_diameter * options.irrigation_diameter;
      s.blood = 0;
      between.clogged[i] = std::max(0.0, between.clogged[i] - s.flow * in.dt);  // driven out
      for (std::size_t a = 0; a < 3; ++a)
        s.velocity[a] =
            between.has_tip[i] ? std::clamp((place[a] - between.tip[i][a]) / in.dt, -2.0, 2.0) : 0.0;
    }
    if (valve[1] > 0) {
      fluid::Suction& s = in.suctions[static_cast<std::size_t>(in.suction_count++)];
      s = fluid::Suction{};
      s.position = place;
      s.flow = between.suction_flow * valve[1] * open(world, i);
    }
    between.tip[i] = place;
    between.has_tip[i] = 1;
  }
  placeObstacles(input, report, in);
  const auto camera = static_cast<std::size_t>(tools::Instrument::Endoscope);
  in.window.present = input.tools[camera].present && input.tools[camera].sight.squaredNorm() > 0.5;
  if (in.window.present) {
    const Eigen::Isometry3d tip = tipOf(input, report, static_cast<int>(camera));
    in.window.position = triple(tip.translation());
    in.window.axis = triple(tip.linear() * input.tools[camera].sight);
    in.window.right = triple(tip.linear().col(0));
  }

  const bool idle = in.source_count == 0 && fluid.particles.count == 0 && !(fluid.emitted > 0);
  // Every so often how the pools weigh: what acts has reached it when the next is told. None: it goes.
  const bool weigh = world.steps() % kBedEvery == 0 || (!idle && !fluid.has_knots);
  if (weigh) feedback.load_over = input.dt * kBedEvery;
  if (!idle) {
    const scene::CavityWalls walls(world.model(), world.state(), input.sunk);
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      const fluid::SurfaceSize most = fluid_model->surfaces[k];
      const auto& triangles = world.contactTriangles(k);
      const auto& alive = world.contactTriangleAlive(k);
      fluid::Surface& s = surfaces[k];
      s.triangles = triangles.data();
      s.triangle_count = std::min(triangles.size(), most.triangles);
      s.alive = alive.size() >= s.triangle_count ? alive.data() : nullptr;
      s.knot_count = world.knotCount(k);
      if (s.knot_count > most.knots)
        s.knot_count = s.triangle_count = 0;  // more than was reserved: cannot be
      s.positions = positions[k].data();
      s.rigid = world.description().objects[k].model == scene::ObjectModel::Rigid;
      s.closed = world.model().objects[k].closed;
      s.still = has_rigid && s.rigid && !((walls.sink() || hangs) && walls.isCavity(k));
      if (s.knot_count == 0 || s.still) continue;
      world.positions(k, positions[k].data());
      if (s.rigid) walls.hang(k, positions[k].data(), s.knot_count);
    }
    has_rigid = true, hangs = walls.sink();
    in.surfaces = surfaces.data();
    in.surface_count = surfaces.size();
    in.renew_bed = weigh;
    in.stains = films;
    in.drying = feedback.gas.drying;
    fluid::step(*fluid_model, in, fluid, scratch, fluid_report);
    for (std::size_t t = 0; t < gauze.size() && fluid_report.status == fluid::Status::Ok; ++t) {
      if (gauze[t] < 0) continue;
      between.swab[t].volume += fluid_report.taken[static_cast<std::size_t>(gauze[t])];
      between.swab[t].blood += fluid_report.taken_blood[static_cast<std::size_t>(gauze[t])];
    }
    degraded |= fluid.degraded;
    refused += fluid_report.status != fluid::Status::Ok;
    for (const fluid::Shear& shear : fluid_report.shears)
      if (films) feedback.films.push_back({shear.surface, shear.triangle, shear.impulse, shear.blood});
    for (const fluid::KnotLoad& load : fluid_report.loads)
      if (feedback.loads.size() < feedback.loads.capacity())
        feedback.loads.push_back(
            {load.surface, load.knot, load.force, load.damping, load.stiffness, load.depth});
    for (const fluid::Impact& impact : fluid_report.impacts) {
      scene::ImpactInput to;
      to.object = impact.surface, to.triangle = impact.triangle;
      for (std::size_t a = 0; a < 3; ++a) to.weights[a] = static_cast<double>(impact.weights[a]);
      to.momentum = {impact.momentum[0], impact.momentum[1], impact.momentum[2]};
      if (world.description().objects[impact.surface].model == scene::ObjectModel::Rigid) continue;
      if (feedback.impacts.size() < feedback.impacts.capacity()) {
        feedback.impacts.push_back(bounded(to, impact.speed, world));
      } else {
        ++dropped;
      }
      if (shown.size() < kMostFrameImpacts) shown.push_back(to);
    }
    for (const scene::ImpactInput& told : feedback.impacts)
      for (const std::uint32_t knot : world.state().objects[told.object].triangles[told.triangle])
        gained[told.object][knot] = 0;
    for (int k = 0; k < fluid_report.lens_count && between.hit_count < lens::kMostHits; ++k) {
      const fluid::LensHit& hit = fluid_report.lens[static_cast<std::size_t>(k)];
      between.hits[static_cast<std::size_t>(between.hit_count++)] = {hit.u, hit.v, hit.volume, hit.blood};
    }
  }
  for (std::size_t t = 0; t < gauze.size(); ++t)
    feedback.swab_room[t] = input.tools[t].present && input.tools[t].tool == tools::ToolKind::Swab
                                ? std::max(0.0, swabRoom(t, report))
                                : 0.0;
}

void OperatingField::Impl::findRoof(const scene::World& world) {
  const smoke::Parameters& p = smoke_model->parameters;
  for (int j = 0; j < smoke_model->ny; ++j)
    for (int i = 0; i < smoke_model->nx; ++i)
      roof.push_back(static_cast<float>(
          scene::roofOver(world.model(), p.low[0] + (i + 0.5) * p.cell, p.low[1] + (j + 0.5) * p.cell)));
  ceiling = roof;
}

const float* OperatingField::Impl::findCeiling(const scene::World& world, double sunk) {
  const scene::CavityWalls walls(world.model(), world.state(), sunk);
  if (!walls.sink()) return nullptr;
  const smoke::Parameters& p = smoke_model->parameters;
  for (std::size_t c = 0; c < roof.size(); ++c) {
    const auto i = static_cast<int>(c) % smoke_model->nx, j = static_cast<int>(c) / smoke_model->nx;
    const Eigen::Vector3d place(p.low[0] + (i + 0.5) * p.cell, p.low[1] + (j + 0.5) * p.cell,
                                static_cast<double>(roof[c]));
    float& lowest = ceiling[c];
    lowest = static_cast<float>(p.high[2]);  // beside the cavity
    for (std::size_t k = 0; k < world.objectCount() && std::isfinite(place.z()); ++k)
      if (walls.isCavity(k))
        lowest = std::min(lowest, static_cast<float>(place.z() - walls.wall(k).by(place)));
  }
  return ceiling.data();
}

smoke::Status OperatingField::Impl::stepSmoke(const scene::World& world, const scene::StepInput& input,
                                              const scene::StepReport& report, double dt, double liquid,
                                              Feedback& feedback) {
  smoke::Inputs s;
  s.dt = dt;
  s.seed = input.seed;
  s.renewal = feedback.gas.renewal;
  s.ceiling = findCeiling(world, input.sunk);
  // A tip that draws liquid draws that much less gas.
  const double could = std::max(1e-9, between.suction_flow);
  feedback.gas_drawn = 0;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto i = static_cast<std::size_t>(t);
    if (between.energy[i] > 0 && s.source_count < smoke::kMostSources) {
      auto& source = s.sources[static_cast<std::size_t>(s.source_count++)];
      source.position = between.energy_place[i];
      source.energy = std::min(1000.0, between.energy[i]);
    }
    between.energy[i] = 0;
    if (sucks(input.tools[i]) && s.suction_count < smoke::kMostSuctions) {
      auto& suction = s.suctions[static_cast<std::size_t>(s.suction_count++)];
      suction.position = triple(tipOf(input, report, t).translation());
      suction.flow = options.suction_gas_flow * std::clamp(1 - liquid / could, 0.0, 1.0) * open(world, i);
      feedback.gas_drawn += suction.flow;
    }
  }
  return smoke::step(*smoke_model, s, smoke, smoke_scratch);
}

void OperatingField::Impl::stepLens(const scene::World& world, const scene::StepInput& input,
                                    const scene::StepReport& report, double dt, const Feedback& feedback) {
  const bool irrigator = std::any_of(input.tools.begin(), input.tools.end(), [](const auto& tool) {
    return tool.present && tool.tool == tools::ToolKind::SuctionIrrigator;
  });
  const auto camera = static_cast<std::size_t>(tools::Instrument::Endoscope);
  const scene::ToolInput& scope = input.tools[camera];
  if (scope.present) {
    lens::Inputs l;
    l.dt = dt;
    l.seed = input.seed;
    l.temperature = feedback.gas.temperature, l.humidity = feedback.gas.humidity;
    between.humidity = l.humidity;
    l.outside = (scope.position - scope.pivot).norm() < kWithdrawn;
    l.wiped = between.wiped != 0;
    l.wiped_on_blood = between.wiped_on_blood;
    l.warmed = between.warming != 0;
    l.rinsed = between.rinse != 0 || (!irrigator && (scope.functions & tools::kFunctionIrrigate));
    const auto place = tipOf(input, report, static_cast<int>(camera)).translation().cast<float>().eval();
    l.smoke = std::min(
        1.0, static_cast<double>(smoke::densityAt(*smoke_model, smoke, place.x(), place.y(), place.z())));
    const Eigen::Vector3d pull = world.description().gravity / 9.81;
    const Eigen::Matrix3d axes = tipOf(input, report, static_cast<int>(camera)).linear();
    l.down = {std::clamp(pull.dot(axes.col(0)), -1.0, 1.0), std::clamp(pull.dot(axes.col(1)), -1.0, 1.0)};
    l.hits = between.hits;
    l.hit_count = between.hit_count;
    refused += lens::step(lens_parameters, l, lens) != lens::Status::Ok;
  }
  between.hit_count = 0;
  between.wiped = 0;
  between.wiped_on_blood = 0;
}

void OperatingField::Impl::show(const scene::World& world) {
  if (!frames) return;
  FieldFrame& f = frames->back();
  f.step = world.steps();
  f.steady_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                    std::chrono::steady_clock::now().time_since_epoch())
                    .count();
  f.fluid_model = fluid_model;
  f.smoke_model = smoke_model;
  f.objects = names;
  copyShown(fluid, f.fluid);
  f.degraded = degraded;
  degraded = false;
  f.smoke.resize(smoke.density.size());
  smoke::drawnDensity(*smoke_model, smoke, f.smoke.data());
  f.puffs = smoke.puffs, f.puff_count = smoke.puff_count;
  f.smoke_mass = smoke::mass(*smoke_model, smoke);
  f.lens = lens;
  f.humidity = between.humidity;
  for (std::size_t t = 0; t < f.clogged.size(); ++t) f.clogged[t] = between.clogged[t] / kBore;
  f.swabs = between.swab;
  f.fog = lens::fog(lens_parameters, lens);
  for (std::size_t i = 0; i < f.fogging.size(); ++i)
    f.fogging[i] = static_cast<float>(lens::fogAt(lens_parameters, lens, i));
  f.impacts.assign(shown.begin(), shown.end());
  f.impacts_dropped = dropped;
  f.refused = refused;
  shown.clear();
  frames->publish();
}

OperatingField::OperatingField(const scene::World& world, const FieldOptions& options,
                               std::shared_ptr<FieldFrames> frames, bool films)
    : impl_(std::make_unique<Impl>(world, options, std::move(frames))) {
  impl_->films = films;
}
OperatingField::~OperatingField() = default;

void OperatingField::step(const scene::World& world, const scene::StepInput& input,
                          const scene::StepReport& report, Feedback& feedback) {
  Impl& m = *impl_;
  static_assert(kSlowEvery % kFluidEvery == 0);
  m.gather(input, report, feedback);
  const bool slow = world.steps() % kSlowEvery == 0;
  const double dt = std::min(0.1, input.dt * kSlowEvery);
  bool smoked = true;
  const auto step_smoke = [&](double liquid) {
    smoked = m.stepSmoke(world, input, report, dt, liquid, feedback) == vest::smoke::Status::Ok;
  };
  if (slow && std::none_of(input.tools.begin(), input.tools.end(), Impl::sucks)) {
    // Where nothing is sucked smoke asks nothing of the fluid, and both go at the same time.
    auto part = [&](std::size_t i) { i == 0 ? m.stepFluid(world, input, report, feedback) : step_smoke(0); };
    world.pool().each(2, part);
  } else {
    if (world.steps() % kFluidEvery == 0) m.stepFluid(world, input, report, feedback);
    if (slow) step_smoke(std::max(0.0, m.fluid.sucked - m.between.sucked) / dt);
  }
  if (slow) {
    m.between.sucked = m.fluid.sucked;
    m.refused += !smoked;
    m.stepLens(world, input, report, dt, feedback);
  }
  if (world.steps() % kFrameEvery == 0) m.show(world);
}

void OperatingField::edits(const scene::World&, std::vector<scene::EditableParameter>& out) const {
  Impl::eachEdit(*impl_, [&](const char* object, const char* parameter, const char* unit, const auto&,
                             double low, double high) {
    out.push_back({object, parameter, unit, low, high});
  });
}

void OperatingField::reset() {
  impl_->begin();
}

double OperatingField::suctionOpen(const scene::World& world, std::size_t tool) const {
  return impl_->open(world, tool);
}

double OperatingField::fog() const {
  return lens::fog(impl_->lens_parameters, impl_->lens);
}

const bleeding::Swab& OperatingField::swab(std::size_t tool) const {
  return impl_->between.swab[tool];
}

const fluid::Model& OperatingField::fluidModel() const {
  return *impl_->fluid_model;
}
const fluid::State& OperatingField::fluid() const {
  return impl_->fluid;
}
const smoke::Model& OperatingField::smokeModel() const {
  return *impl_->smoke_model;
}
const smoke::State& OperatingField::smoke() const {
  return impl_->smoke;
}
const lens::State& OperatingField::lens() const {
  return impl_->lens;
}

}  // namespace vest::simulation

#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "between.h"
#include "vest_bringup/simulation/operating_field.h"

namespace vest::simulation {

struct OperatingField::Impl {
  FieldOptions options;
  std::shared_ptr<const fluid::Model> fluid_model;
  std::shared_ptr<smoke::Model> smoke_model;
  lens::Parameters lens_parameters;
  fluid::State fluid;
  smoke::State smoke;
  lens::State lens;
  Between between;

  // No meaning between steps.
  fluid::Scratch scratch;
  smoke::Scratch smoke_scratch;
  fluid::Inputs fluid_inputs;
  fluid::Report fluid_report;
  std::vector<fluid::Surface> surfaces;
  std::vector<std::vector<float>> gained;  ///< m/s, per knot: of the impacts that are being told
  std::vector<std::vector<float>> positions;
  std::shared_ptr<FieldFrames> frames;
  std::shared_ptr<const std::vector<std::string>> names;
  std::vector<scene::ImpactInput> shown;
  std::uint64_t dropped = 0, refused = 0;
  bool degraded = false;
  bool has_rigid = false;  ///< places of rigid objects are known: they stay
  bool films = false;
  bool hangs = false;          ///< of these, the cavity's are those of a wall that hangs
  std::vector<float> roof;     ///< m, world: the cavity's, over each column of smoke; NaN: none
  std::vector<float> ceiling;  ///< likewise, where it hangs now

  Impl(const scene::World& world, const FieldOptions& o, std::shared_ptr<FieldFrames> f)
      : options(o),
        fluid_model(std::make_shared<const fluid::Model>(fluid::buildModel(o.fluid, sizes(world)))),
        smoke_model(std::make_shared<smoke::Model>(smoke::buildModel(o.smoke))),
        lens_parameters(o.lens),
        scratch(*fluid_model, o.threads),
        smoke_scratch(*smoke_model),
        frames(std::move(f)) {
    lens::check(o.lens);
    surfaces.resize(world.objectCount());
    positions.resize(world.objectCount());
    gained.resize(world.objectCount());
    auto n = std::make_shared<std::vector<std::string>>();
    for (std::size_t i = 0; i < world.objectCount(); ++i) {
      positions[i].resize(3 * fluid_model->surfaces[i].knots);
      gained[i].resize(fluid_model->surfaces[i].knots);
      n->push_back(world.description().objects[i].name);
    }
    names = n;
    findRoof(world);
    fluid_report.impacts.reserve(fluid_model->triangles);
    shown.reserve(kMostFrameImpacts);
    begin();
    if (!frames) return;
    frames->forEachSlot([this](FieldFrame& slot) {
      slot.fluid = fluid;
      slot.smoke.resize(smoke.density.size());
      slot.impacts.reserve(kMostFrameImpacts);
    });
  }

  void findRoof(const scene::World& world);
  /// Where smoke ends for a wall that hangs. @return null: it does not
  const float* findCeiling(const scene::World& world, double sunk);
  /// Cuts add knots and triangles: a quarter more, as the World itself reserves.
  static std::vector<fluid::SurfaceSize> sizes(const scene::World& world) {
    std::vector<fluid::SurfaceSize> s;
    for (std::size_t i = 0; i < world.objectCount(); ++i) {
      const std::size_t knots = world.knotCount(i), triangles = world.contactTriangles(i).size();
      s.push_back({knots + knots / 4 + 256, triangles + triangles / 2 + 256});
    }
    return s;
  }

  void begin() {
    fluid = fluid::initialState(*fluid_model);
    smoke = smoke::initialState(*smoke_model);
    lens_parameters = options.lens;
    lens = lens::initialState(lens_parameters);
    std::memset(static_cast<void*>(&between), 0, sizeof between);  // its padding too: bytes are hashed
    between.irrigation_flow = options.irrigation_flow;
    between.suction_flow = options.suction_flow;
    between.bag_pressure = options.bag_pressure;
    between.yield = options.smoke.yield;
    apply();
    shown.clear();
  }

  /// Numbers that edits may change reach the cores.
  void apply() { smoke_model->parameters.yield = between.yield; }

  /// Each number that edits change: visit(object, parameter, unit, number, lowest, highest). The lens'
  /// warming and rinse are 0 or 1.
  template <class Self, class Visit>
  static void eachEdit(Self& s, Visit&& visit) {
    auto& b = s.between;
    visit("fluid", "irrigation_flow", "m³/s", b.irrigation_flow, 0.0, 5e-4);
    visit("fluid", "suction_flow", "m³/s", b.suction_flow, 0.0, 5e-4);
    visit("fluid", "bag_pressure", "Pa", b.bag_pressure, 0.0, 6e4);
    visit("smoke", "yield", "kg/J", b.yield, 0.0, 1e-4);
    visit("lens", "temperature", "K", s.lens.temperature, 250.0, 318.15);
    visit("lens", "warming", "", b.warming, 0.0, 1.0);
    visit("lens", "rinse", "", b.rinse, 0.0, 1.0);
  }

  void edit(const scene::ParameterEdit& e) {
    if (!std::isfinite(e.value)) return;
    eachEdit(*this,
             [&](const char* object, const char* parameter, const char*, auto& to, double low, double high) {
               if (e.object != object || e.parameter != parameter) return;
               const double value = std::clamp(e.value, low, high);
               if constexpr (std::is_same_v<std::decay_t<decltype(to)>, std::uint8_t>) {
                 to = value > 0.5;
               } else {
                 to = value;
               }
             });
    apply();
  }

  void gather(const scene::StepInput& input, const scene::StepReport& report, const Feedback& feedback);
  /// An impact as the tissue takes it: in one step no knot changes its velocity by more than the fluid did,
  /// so that no more energy passes than the fluid had. Chips and thin walls weigh far less than the drop that
  /// strikes them.
  scene::ImpactInput bounded(scene::ImpactInput impact, double speed, const scene::World& world);
  double swabRoom(std::size_t tool, const scene::StepReport& report) const;
  void stepFluid(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
                 Feedback& feedback);
  /// Of a sucker's bore, 0 … 1: what clot and tissue on the tip leave.
  double open(const scene::World& world, std::size_t tool) const;
  /// A tip with its suction on draws of the smoke what the liquid leaves it.
  static bool sucks(const scene::ToolInput& tool) {
    return tool.present && tool.tool == tools::ToolKind::SuctionIrrigator &&
           (tool.functions & tools::kFunctionSuck) != 0;
  }
  /// @param dt s  @param liquid m³/s that was sucked since the last time
  smoke::Status stepSmoke(const scene::World& world, const scene::StepInput& input,
                          const scene::StepReport& report, double dt, double liquid, Feedback& feedback);
  void stepLens(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report,
                double dt, const Feedback& feedback);
  void show(const scene::World& world);
};

}  // namespace vest::simulation

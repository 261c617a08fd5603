#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/stages.h"
#include "heat_step.h"
#include "vest_tissue/interaction/grasp.h"
#include "vest_tissue/interaction/heat.h"
#include "vest_tissue/scene/topology.h"

namespace vest::scene {
namespace {

using interaction::Electrode;
using interaction::HeatColumn;
using interaction::HeatModel;
using interaction::HeatState;
using net::Block;

constexpr std::uint64_t kLinkEvery = 16;  ///< steps between two renewals of what denaturation does to links
constexpr double kCold = 1e-3;            ///< K: an object nowhere warmer is at body temperature again
constexpr double kTellEvery = 1.0;        ///< s between two events of one activation

const interaction::ColumnShape& shapeOf(const Context& c, std::size_t object, std::uint32_t knot) {
  const auto& shapes = c.model.objects[object].heat.shapes;
  const std::size_t original = originalKnot(c.state.objects[object].topology, shapes.size(), knot);
  return shapes[std::min(original, shapes.size() - 1)];  // a knot without an original: like its neighbours
}

interaction::ThermalMaterial materialOf(const Context& c, std::size_t object, std::uint32_t knot) {
  const HeatModel& model = c.model.objects[object].heat;
  interaction::ThermalMaterial m = model.material;
  if (model.perfusion.empty()) return m;
  const std::size_t original = originalKnot(c.state.objects[object].topology, model.perfusion.size(), knot);
  m.perfusion = model.perfusion[std::min(original, model.perfusion.size() - 1)];
  return m;
}

/// Energy into a knot, less what dry tissue refuses. Returns J delivered.
double heatKnot(Context& c, std::size_t object, std::uint32_t knot, double energy, bool deep) {
  ObjectState& s = c.state.objects[object];
  HeatColumn& column = s.heat.columns[knot];
  const double passed = energy / (1.0 + interaction::kDryResistance * column.dried[0]);
  interaction::deliver(column, shapeOf(c, object, knot), c.model.objects[object].heat.material,
                       row(s, Block::kMass)[knot], passed, deep, s.heat.ledger);
  s.heat.touched = s.heat.warm = true;
  return passed;
}

/// Wire of the hook on a surface: the power is shared by what touches.
void monopolar(Context& c, int tool, Electrode& e) {
  constexpr int kFirstWire = 2;  // capsules of the hook: shaft, ceramic neck, then the bare wire
  const double energy = c.state.electrosurgery.monopolar_power * c.dt;
  const auto touches = [&](std::size_t object, const contact::ToolContact& t) {
    return t.tool == tool && t.capsule >= kFirstWire &&
           gapOf(c.state.objects[object], t) < interaction::kElectrodeReach;
  };
  int count = 0;
  for (std::size_t object = 0; object < c.model.objects.size(); ++object)
    for (const auto& t : c.scratch.objects[object].contacts) count += touches(object, t);
  if (count == 0) return;
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    for (const auto& t : c.scratch.objects[object].contacts) {
      if (!touches(object, t)) continue;
      e.object = static_cast<std::uint16_t>(object);
      e.element = t.triangle;
      for (int n = 0; n < 3; ++n) {
        e.weights[n] = t.weights[n];
        if (t.weights[n] > 0.0f)
          e.energy += heatKnot(c, object, t.knots[n], energy * t.weights[n] / count, false);
      }
    }
  }
}

/// Current between the jaws heats all that they hold, through and through.
void bipolar(Context& c, int tool, Electrode& e) {
  const auto& grasp = c.state.grasps[tool];
  if (!grasp.active || grasp.count == 0) return;
  const double energy = c.state.electrosurgery.bipolar_power * c.dt / grasp.count;
  for (int i = 0; i < grasp.count; ++i)
    e.energy += heatKnot(c, grasp.anchors[i].object, grasp.anchors[i].knot, energy, true);
  e.object = grasp.anchors[0].object;
  e.element = grasp.element;
  e.weights = {grasp.barycentric[0], grasp.barycentric[1], grasp.barycentric[2]};
}

Eigen::Vector3d placeOf(const Context& c, const Electrode& e) {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  const auto& knots = c.state.objects[e.object].triangles[e.element];
  for (int i = 0; i < 3; ++i) place += e.weights[i] * knotPosition(c.state.objects[e.object], knots[i]);
  return place;
}

Event eventOf(const Context& c, int tool, const Electrode& e) {
  Event event = eventOf(c, EventKind::Coagulated, tool, e.object, e.element);
  event.barycentric = {e.weights[0], e.weights[1], e.weights[2], 0.0};
  event.position = placeOf(c, e);
  event.station =
      stationOf(c.model, c.state, e.object, c.state.objects[e.object].triangles[e.element], e.weights);
  event.area = std::numeric_limits<double>::quiet_NaN();
  event.energy = e.energy;
  return event;
}

void electrodes(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    Electrode& e = c.state.electrosurgery.electrodes[t];
    const auto& proxy = c.state.proxies[t];
    const bool hook = proxy.tool == tools::ToolKind::CoagulationHook,
               forceps = proxy.tool == tools::ToolKind::BipolarForceps;
    const bool on =
        proxy.present && (hook || forceps) && (c.input.tools[t].functions & tools::kFunctionCoagulate) != 0;
    if (on && !e.on) e.since = c.state.step, e.energy = 0.0;
    const double before = e.energy;
    if (on && hook) monopolar(c, t, e);
    if (on && forceps) bipolar(c, t, e);
    if (e.energy > before) c.report.heat[t] = {e.energy - before, placeOf(c, e)};
    const bool late = on && static_cast<double>(c.state.step - e.since) * c.dt >= kTellEvery;
    if (e.energy > 0.0 && (late || !on)) {
      emit(c, eventOf(c, t, e));
      e.energy = 0.0;
      e.since = c.state.step;
    }
    e.on = on;
  }
}

/// Jaws that pinch harder than the tissue bears destroy it with time (heat.h).
void crush(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto& grasp = c.state.grasps[t];
    if (!grasp.active || !interaction::hasJaws(c.state.proxies[t].tool)) continue;
    const auto& g = tools::toolGeometry(c.state.proxies[t].tool);
    const double pressure = grasp.pinch / (2.0 * interaction::kJawHalfWidth * std::max(g.jaw_length, 1e-3));
    for (int i = 0; i < grasp.count; ++i) {
      const auto& a = grasp.anchors[i];
      const double threshold = c.model.objects[a.object].heat.grasp_damage_threshold;
      if (!(threshold > 0.0) || pressure <= threshold) continue;
      HeatState& heat = c.state.objects[a.object].heat;
      HeatColumn& column = heat.columns[a.knot];
      column.crushed =
          std::min(1.0, column.crushed + c.dt * (pressure / threshold - 1.0) / interaction::kCrushTime);
      heat.touched = true;
    }
  }
}

/// Heat flow of one object: between its knots, then each column.
void conduct(Context& c, std::size_t object, double dt) {
  ObjectState& s = c.state.objects[object];
  HeatState& heat = s.heat;
  if (!heat.warm) return;
  const HeatModel& model = c.model.objects[object].heat;
  const float* const mass = row(s, Block::kMass);
  c.body(object).conduct(c, object, dt);
  double warmest = 0.0;
  for (std::uint32_t k = 0; k < s.block.knots(); ++k) {
    HeatColumn& column = heat.columns[k];
    if (column.excess == decltype(column.excess){}) continue;
    const double before = column.denatured;
    interaction::stepColumn(column, shapeOf(c, object, k), materialOf(c, object, k), mass[k], model.density,
                            dt, heat.ledger);
    heat.denaturing = heat.denaturing || column.denatured != before;
    for (const double e : column.excess) warmest = std::max(warmest, std::fabs(e));
  }
  if (warmest > kCold) return;
  heat.warm = false;  // the last traces are carried off
  for (std::uint32_t k = 0; k < s.block.knots(); ++k) {
    HeatColumn& column = heat.columns[k];
    heat.ledger.perfused += interaction::storedHeat(column, shapeOf(c, object, k), model.material, mass[k]);
    column.excess = {};
  }
}

/// A vessel whose wall is denatured all around is closed.
void seal(Context& c, std::size_t object) {
  ObjectState& s = c.state.objects[object];
  const net::TubeMap& tube = c.model.objects[object].tube;
  for (std::size_t part = 0; part < 2 * s.heat.sealed.size(); ++part) {
    // A cut leaves two walls of a ring, each with its own end of the vessel: a bit each.
    const std::size_t r = part / 2;
    const bool above = part % 2 != 0, whole = c.scratch.objects[object].rings.whole(tube, r);
    const auto bits = static_cast<std::uint8_t>(whole ? 3 : above ? 2 : 1);
    const net::CutRings::Ring ring = ringNow(c, object, r, above);
    if ((s.heat.sealed[r] & bits) == bits || ring.count < 3 || (whole && above)) continue;
    bool all = true;
    for (const auto k : ring) all = all && s.heat.columns[k].denatured >= interaction::kSealed;
    if (!all) continue;
    s.heat.sealed[r] |= bits;
    Event e = eventOf(c, EventKind::Coagulated, -1, object, ring.knots[0]);
    for (const auto k : ring) e.position += knotPosition(s, k) / static_cast<double>(ring.count);
    e.station = tube.station(r);
    e.area = 0.0;
    for (int t = 0; t < tools::kInstrumentCount; ++t) {
      Electrode& by = c.state.electrosurgery.electrodes[t];
      if (by.energy <= 0.0 || by.object != object) continue;
      e.instrument = static_cast<std::int8_t>(t);
      e.energy = by.energy;
      by.energy = 0.0;
      by.since = c.state.step;
      break;
    }
    emit(c, e);
  }
}

}  // namespace

/// Layer by layer.
void exchangeHeat(Context& c, std::size_t object, std::uint32_t p, std::uint32_t q, float conductance,
                  double dt) {
  HeatState& heat = c.state.objects[object].heat;
  HeatColumn &a = heat.columns[p], &b = heat.columns[q];
  if (a.excess == b.excess) return;  // nearly all pairs: both at body temperature
  const double specific = c.model.objects[object].heat.material.heat_capacity;
  const float* const mass = row(c.state.objects[object], Block::kMass);
  const auto &sa = shapeOf(c, object, p), &sb = shapeOf(c, object, q);
  for (std::size_t layer = 0; layer < interaction::kThermalLayers; ++layer) {
    const double share = std::min(sa.share[layer], sb.share[layer]);
    if (!(share > 0.0)) continue;
    const double ca = specific * mass[p] * sa.share[layer], cb = specific * mass[q] * sb.share[layer];
    const double flow =
        interaction::exchange(conductance * share, a.excess[layer], b.excess[layer], ca, cb, dt);
    a.excess[layer] += flow / ca;
    b.excess[layer] -= flow / cb;
  }
}

void stepHeat(Context& c) {
  electrodes(c);
  crush(c);
  // Electrodes give it each step; it spreads slowly, and stays for minutes.
  const auto every = static_cast<std::uint64_t>(std::max(1.0, kHeatStep / c.dt));
  const double dt = c.state.step % every == 0 ? static_cast<double>(every) * c.dt : 0.0;
  eachBody(c, [&c, dt](std::size_t object) {
    if (dt > 0.0) conduct(c, object, dt);
    if (c.state.step % kLinkEvery == 0 && c.state.objects[object].heat.denaturing)
      c.body(object).denature(c.state.objects[object]);
  });
  if (c.state.step % kLinkEvery != 0) return;
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    HeatState& h = c.state.objects[object].heat;
    if (!h.denaturing) continue;
    h.denaturing = false;
    seal(c, object);
  }
}

}  // namespace vest::scene

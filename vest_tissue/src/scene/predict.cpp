#include <algorithm>
#include <cmath>
#include <iterator>

#include "stages.h"
#include "vest_tissue/scene/edits.h"
#include "vest_tissue/scene/topology.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

constexpr std::uint64_t kBoundEvery = 4;  ///< steps between two looks at an object's strain
constexpr double kBoundWay = 1e-5;        ///< m: less is no strain worth a look, links are millimetres long
/// A look before the turn: an object moved this part of its longest edge since the last one, and a link is
/// stretched beyond this part of where its law ends. Its tangent may be many times what the sub-steps were
/// for (tuned).
constexpr double kBoundLeap = 0.25;
constexpr float kBoundStretch = 0.75f;
/// m/s: what fluid strikes does not outrun it, however much more a drop weighs than a knot of a thin wall (27
/// mg against less than 1 mg). No drop is faster (fluid/emit.cpp).
constexpr double kFastestFluid = 10.0;
constexpr float kGrowth = 1.2f;  ///< of the tangent, below which the old bound still holds (its margin)

/// Times a step that held forces have to be renewed for the shape and the parts that there are now.
int exchangesNow(const ObjectConstants& constants, const ObjectState& s, double dt, int most,
                 solver::BoundScratch& scratch) {
  const solver::Rates slow = solver::elementRates(s.block, s.elements, scratch);
  const double needed = dt / (solver::kStepMargin * solver::longestStep(slow));
  int batches = constants.batches;
  while (batches < needed && 2 * batches <= most) batches *= 2;
  return batches;
}

void applyEdit(Context& c, const ParameterEdit& edit) {
  if (!std::isfinite(edit.value)) return;
  if (edit.object.empty()) {
    auto& generator = c.state.electrosurgery;
    double* const to[] = {&c.state.gravity.x(), &c.state.gravity.y(), &c.state.gravity.z(),
                          &generator.monopolar_power, &generator.bipolar_power};
    static_assert(std::size(to) == kWorldParameters.size());
    for (std::size_t i = 0; i < kWorldParameters.size(); ++i)
      if (edit.parameter == kWorldParameters[i].name)
        *to[i] = std::clamp(edit.value, kWorldParameters[i].low, kWorldParameters[i].high);
    return;
  }
  for (std::size_t i = 0; i < c.model.objects.size(); ++i) {
    if (c.model.description.objects[i].name != edit.object || !c.model.objects[i].net) continue;
    ObjectState& s = c.state.objects[i];
    const bool stiffer = edit.parameter == "youngs_modulus", damped = edit.parameter == "damping_scale";
    if (!stiffer && !damped) continue;
    const double law = c.model.objects[i].law.youngs_modulus;
    const double wanted =
        std::clamp(stiffer ? (law > 0.0 ? edit.value / law : 1.0) : edit.value, kLeastScale, kGreatestScale);
    double& scale = stiffer ? s.elastic_scale : s.damping_scale;
    const float factor = static_cast<float>(wanted / scale);
    keepShape(c, i);
    for (std::size_t e = 0; e < s.links.size(); ++e) {
      const net::KernelLink& l = s.links[e].values;
      setLink(s, e, stiffer ? l.axial * factor : l.axial, l.rest, stiffer ? l.damping : l.damping * factor);
    }
    scale = wanted;
    if (stiffer) s.tissue.stiffness_scale = wanted;
  }
}

void applyImpact(Context& c, const ImpactInput& impact) {
  if (impact.object >= c.model.objects.size() || !c.model.objects[impact.object].net ||
      !impact.momentum.allFinite())
    return;
  ObjectState& s = c.state.objects[impact.object];
  if (impact.triangle >= s.triangles.size()) return;
  for (int e = 0; e < 3; ++e) {
    const std::uint32_t k = s.triangles[impact.triangle][e];
    const double w = impact.weights[e] * row(s, Block::kInverseMass)[k];
    if (!std::isfinite(w)) continue;
    Vector3d gained = w * impact.momentum;
    const double speed = std::sqrt(gained.squaredNorm());
    if (!std::isfinite(speed)) continue;
    if (speed > kFastestFluid) gained *= kFastestFluid / speed;
    if (c.model.objects[impact.object].fem) {  // elastostatic objects have no momentum to take
      if (s.tissue.dynamic) s.tissue.v[k] += gained;
      continue;
    }
    s.block.row(Block::VX)[k] += static_cast<float>(gained.x());
    s.block.row(Block::VY)[k] += static_cast<float>(gained.y());
    s.block.row(Block::VZ)[k] += static_cast<float>(gained.z());
  }
}

/// A vessel's pulse widens its rings: their rest length follows the radius where they are.
void applyDilatation(Context& c, const DilatationInput& d) {
  for (const float x : d.dilatation)
    if (!std::isfinite(x)) return;
  for (std::size_t i = 0; i < c.model.objects.size(); ++i) {
    if (c.model.description.objects[i].tube.vessel_segment != d.vessel_segment.view() ||
        d.vessel_segment.empty())
      continue;
    ObjectState& s = c.state.objects[i];
    keepRings(c, i);
    for (const auto& [e, place] : c.model.objects[i].ring_links) {
      const net::KernelLink& l = s.links[e].values;
      const auto before = std::min(static_cast<std::size_t>(place), d.dilatation.size() - 2);
      const float part = place - static_cast<float>(before);
      const float scale =
          std::clamp((1 - part) * d.dilatation[before] + part * d.dilatation[before + 1], 0.5f, 2.0f);
      setLink(s, e, l.axial, c.model.start.objects[i].links[e].values.rest * scale * s.links[e].shrink,
              l.damping);
    }
  }
}

/// Sub-steps of an object for its present strain. Only numbers of the State enter: re-simulation takes the
/// same.
void renewBound(Context& c, std::size_t object) {
  const ObjectConstants& constants = c.model.objects[object];
  ObjectState& s = c.state.objects[object];
  if (!constants.net || constants.fem || constants.implicit) return;
  if ((c.state.step + object) % kBoundEvery != 0) {
    const double moved = std::fmod(s.way - std::max(0.0, s.way_bounded), 1.0);  // whole metres are cuts
    if (!(moved > kBoundLeap * constants.greatest_edge) ||
        !(solver::greatestStrain(boundLinks(s)) >
          kBoundStretch * static_cast<float>(constants.law.max_strain)))
      return;
  }
  const bool scaled =
      s.elastic_scale > 1.0 || s.damping_scale > 1.0 || s.heat.stiffened || !s.topology.doubled_knots.empty();
  if (s.way_bounded >= 0.0 && s.way - s.way_bounded < kBoundWay && !scaled && !s.degraded) return;
  s.way_bounded = s.way;
  ObjectScratch& o = c.scratch.objects[object];
  const bool was_degraded = s.degraded;
  if (s.degraded) {
    s.degraded = false;
    s.limit_strain = static_cast<float>(constants.law.max_strain);
    s.law_links.setMaxStrain(s.limit_strain);
  }
  solver::BoundLinks links = boundLinks(s);
  const auto& a = links.law;
  const float strain = solver::greatestStrain(links);
  const float e = std::min(strain, a.max_strain);
  const float tangent = 1.0f + e * (2 * a.a2 + e * (3 * a.a3 + e * 4 * a.a4));
  // Removed links leave every bound valid; doubled knots do not.
  const bool cut = !s.topology.doubled_knots.empty();
  if (tangent <= kGrowth && strain < 0.5f && !scaled) {
    s.sub_steps = constants.sub_steps;
    s.batches = constants.batches;
    s.bound_strain = 0.0f;
    return;
  }
  const double dt = c.model.description.dt;
  const int most = static_cast<int>(solver::kSubStepsPerSecond * dt);
  const int before = s.batches;
  s.batches = exchangesNow(constants, s, dt, most, o.bound);
  // The bound of a strain serves for a little more and for somewhat less.
  if (!scaled && !was_degraded && s.batches == before && strain < 1.05f * s.bound_strain &&
      strain > 0.8f * s.bound_strain)
    return;
  s.bound_strain = strain;
  const int limit = std::max(s.batches, most / s.batches * s.batches);  // of whole batches
  int needed = 1;
  for (int attempt = 0; attempt < 8; ++attempt) {
    solver::Rates rates = solver::linkRates(links, o.bound);
    rates.omega_squared =
        rates.omega_squared * (cut ? 1.0 : constants.calibration) + constants.contact_omega_squared;
    rates.decay = constants.rates.decay * std::max(1.0, s.damping_scale);
    needed = solver::subSteps(dt, rates);
    if (needed <= limit) break;
    // Declared fallback: the law goes on along its tangent from a smaller strain, softer but bounded.
    s.degraded = true;
    s.limit_strain *= 0.5f;
    s.law_links.setMaxStrain(s.limit_strain);
    links.law = s.law_links.law();
  }
  needed = std::clamp(needed, constants.sub_steps, limit);
  s.sub_steps = (needed + s.batches - 1) / s.batches * s.batches;
}

/// Links of objects that tear, stretched further than they bear.
void tear(Context& c, std::size_t object) {
  const Object& described = c.model.description.objects[object];
  ObjectState& s = c.state.objects[object];
  const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z);
  const float most = static_cast<float>((1.0 + described.tear_strain) * (1.0 + described.tear_strain));
  TopologyDelta& delta = c.deltas->next();
  beginDelta(c.state, static_cast<std::uint16_t>(object), delta);
  for (std::size_t i = 0;
       i < s.topology.links.size() && delta.removed_links.size() < delta.removed_links.capacity(); ++i) {
    if (!s.topology.link_alive[i] || s.places[i].kind != LinkKind::Elastic) continue;
    const net::KernelLink& l = s.links[s.places[i].index].values;
    const float dx = x[l.knot1] - x[l.knot0], dy = y[l.knot1] - y[l.knot0], dz = z[l.knot1] - z[l.knot0];
    if (!(dx * dx + dy * dy + dz * dz > most * l.rest * l.rest)) continue;
    if (delta.removed_links.empty()) {
      keepShape(c, object);
      Event e;
      e.kind = EventKind::Torn;
      e.step = c.state.step;
      e.object = static_cast<std::uint16_t>(object);
      e.element = static_cast<std::uint32_t>(i);
      e.position = 0.5 * (knotPosition(s, l.knot0) + knotPosition(s, l.knot1));
      e.station = stationOf(c.model, c.state, object, {l.knot0, l.knot1, l.knot1}, {0.5, 0.5, 0.0});
      e.area = s.topology.links[i].area;
      emit(c, e);
    }
    tearLink(c.state, static_cast<std::uint16_t>(object), static_cast<std::uint32_t>(i), delta);
  }
  if (delta.removed_links.empty()) return;
  endDelta(c.state, delta);
  c.deltas->keep();
}

}  // namespace

double stationOf(const WorldModel& model, const WorldState& state, std::size_t object,
                 const std::array<std::uint32_t, 3>& knots, const std::array<double, 3>& weights) {
  std::array<std::uint32_t, 3> of_scene;
  for (std::size_t i = 0; i < 3; ++i) {
    of_scene[i] = originalKnot(state.objects[object].topology,
                               model.description.objects[object].position.size(), knots[i]);
  }
  return model.objects[object].tube.stationAt(of_scene, weights);
}

bool applyRequest(const WorldModel& model, WorldState& state, DeltaHistory& deltas,
                  const TopologyRequest& request, std::uint32_t& copy) {
  if (request.kind == TopologyRequest::Kind::RemoveClip) return false;  // no topology: removeClip
  if (request.object >= state.objects.size() || !model.objects[request.object].net) return false;
  TopologyDelta& delta = deltas.next();
  beginDelta(state, request.object, delta);
  const bool done = request.kind == TopologyRequest::Kind::RemoveLink
                        ? tearLink(state, request.object, request.element, delta)
                        : splitKnot(state, request.object, request.element, request.normal, copy, delta);
  if (!done) return false;
  endDelta(state, delta);
  deltas.keep();
  return true;
}

bool checkInput(const StepInput& input) {
  if (!(input.dt >= 1e-6 && input.dt <= 0.01)) return false;
  for (const ToolInput& t : input.tools) {
    if (!t.present) continue;
    const double q = t.orientation.squaredNorm();
    if (!t.position.allFinite() || !t.pivot.allFinite() || !std::isfinite(t.jaw) || !(q > 0.25 && q < 4.0))
      return false;
    if (!(t.position.squaredNorm() < 1e6) || !(t.pivot.squaredNorm() < 1e6)) return false;
  }
  return true;
}

void predict(Context& c) {
  for (const ParameterEdit& edit : c.input.edits) applyEdit(c, edit);
  for (const ImpactInput& impact : c.input.impacts) applyImpact(c, impact);
  for (const DilatationInput& dilatation : c.input.dilatations) applyDilatation(c, dilatation);
  std::uint32_t copy;
  for (const TopologyRequest& request : c.input.requests) {
    if (request.kind == TopologyRequest::Kind::RemoveClip) {
      removeClip(c, request.element);
      continue;
    }
    if (request.object < c.state.objects.size()) keepShape(c, request.object);
    applyRequest(c.model, c.state, *c.deltas, request, copy);
  }
  for (std::size_t i = 0; i < c.model.objects.size(); ++i) {
    if (c.model.objects[i].net && c.model.description.objects[i].tear_strain > 0.0) tear(c, i);
  }
  auto work = [&c](std::size_t object) {
    renewBound(c, object);
    const Topology& topology = c.state.objects[object].topology;
    const std::size_t knots = c.model.description.objects[object].position.size();
    c.scratch.objects[object].rings.renew(
        c.model.objects[object].tube, c.state.objects[object].triangles,
        c.state.objects[object].triangle_alive, topology.revision, !topology.doubled_knots.empty(),
        [&](std::uint32_t knot) { return originalKnot(topology, knots, knot); });
  };
  c.pool.each(c.model.objects.size(), work);
}

}  // namespace vest::scene

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

/// m/s: what fluid strikes does not outrun it, however much more a drop weighs than a knot of a thin wall (27
/// mg against less than 1 mg). No drop is faster (fluid/emit.cpp).
constexpr double kFastestFluid = 10.0;

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
    if (c.model.description.objects[i].name != edit.object || !c.model.objects[i].deforms) continue;
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
  if (impact.object >= c.model.objects.size() || !c.model.objects[impact.object].deforms ||
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
    c.body(impact.object).accelerate(s, k, gained);
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

/// Steps between two looks at an object's links (tuned). At each step they took a tenth of the gynaecology
/// scene's time.
constexpr std::uint64_t kTearEvery = 8;

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
  if (request.object >= state.objects.size() || !model.objects[request.object].deforms) return false;
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
  if (!(input.dt >= 1e-6 && input.dt <= 0.01) || !(input.sunk >= 0.0 && input.sunk <= 1.0)) return false;
  for (const ToolInput& t : input.tools) {
    if (!t.present) continue;
    const double q = t.orientation.squaredNorm();
    if (!t.position.allFinite() || !t.pivot.allFinite() || !std::isfinite(t.jaw) || !(q > 0.25 && q < 4.0))
      return false;
    if (!(t.position.squaredNorm() < 1e6) || !(t.pivot.squaredNorm() < 1e6)) return false;
  }
  return true;
}

/// What a step knows of where an object was: impacts change no place, and splits put copies behind.
void keepPlaces(Context& c, std::size_t object) {
  const ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  std::copy_n(s.block.motion(), o.backup.size(), o.backup.data());
  o.backup_x.assign(s.tissue.x.begin(), s.tissue.x.end());
}

void findBox(Context& c, std::size_t object) {
  const ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  for (int axis = 0; axis < 3; ++axis) {
    const float* const p = row(s, static_cast<Block::KnotRow>(Block::X + axis));
    net::knotLoops(c.level).extent(p, s.block.knots(), o.low[axis], o.high[axis]);
  }
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
  for (const std::size_t i : c.model.bodies)
    if (c.model.description.objects[i].tear_strain > 0.0 && (c.state.step + i) % kTearEvery == 0) tear(c, i);
  const auto renew = [&c](std::size_t object) {
    const Topology& topology = c.state.objects[object].topology;
    const std::size_t knots = c.model.description.objects[object].position.size();
    c.scratch.objects[object].rings.renew(
        c.model.objects[object].tube, c.state.objects[object].triangles,
        c.state.objects[object].triangle_alive, topology.revision, !topology.doubled_knots.empty(),
        [&](std::uint32_t knot) { return originalKnot(topology, knots, knot); });
    contract(c, object);
  };
  for (std::size_t i = 0; i < c.model.objects.size(); ++i)
    if (!c.model.objects[i].deforms) renew(i);
  eachBody(c, [&](std::size_t object) {
    keepPlaces(c, object);
    c.body(object).renewBound(c, object);
    renew(object);
    findBox(c, object);
  });
}

}  // namespace vest::scene

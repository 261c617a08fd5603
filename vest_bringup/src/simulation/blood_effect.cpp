#include "vest_bringup/simulation/blood_effect.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "field_parts.h"
#include "vessel_geometry.h"
#include "vest_effects/bleeding/kink.h"
#include "vest_effects/bleeding/swab.h"
#include "vest_effects/state_bytes.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::simulation {

namespace {

using Eigen::Vector3d;
namespace hd = haemodynamics;

constexpr std::uint64_t kKinksEvery = 16;  // steps
constexpr std::uint64_t kDilateEvery = 4;  // steps: 250 Hz follows a pulse, and a session stays small
// Of an opening that tells no area: a needle of 0.8 mm.
constexpr double kNeedleArea = 5.0e-7;  // m²
// Heat that shuts a hole: of the order of 4 J per square millimetre (assumed; bipolar sealing of a 4 mm
// vessel takes some 50 J).
constexpr double kSealEnergyPerArea = 4.0e6;  // J/m²
// About a place of a vessel: a tool that touches tissue there presses on the vessel too. Two jaws' widths.
constexpr double kPressReach = 0.010;  // m (assumed)
constexpr double kPi = 3.14159265358979323846;
// Of an instructor's opening: from a tenth of the finest needle (0.3 mm) to more than any vessel has.
constexpr double kLeastOpening = 7.0e-9, kGreatestOpening = 0.01;  // m²

// What edits change of the whole circulation, in the order of BloodEffect::take.
struct Setting {
  const char *name, *unit;
  double low, high;
};
/// Of a snapshot: no artery is as wide (m²), no blood as fast (m/s); a step of such would take seconds.
constexpr double kWidest = 0.01, kFastest = 1000;

constexpr Setting kSettings[] = {
    {"heart_rate", "Hz", 0.3, 4.0},      {"mean_pressure", "Pa", 2000.0, 30000.0},
    {"resistance_scale", "", 0.1, 10.0}, {"reflex_scale", "", 0.0, 1.0},
    {"infusion", "m³/s", 0.0, 1e-5},     {"transfusion", "m³/s", 0.0, 1e-5},
    {"pulse_dilatation", "", 0.0, 20.0}};

/// The patient's vessels, and those that the scene has beside them.
hd::Vessels vesselsOf(const scene::World& world, const std::string& folder) {
  hd::Vessels vessels = hd::readVessels(folder);
  const scene::Description& description = world.description();
  for (const scene::VesselTree& tree : description.vessels)
    hd::graft(hd::parseCase(description.directory + "/" + tree.folder,
                            {tree.case_json, tree.network_csv, tree.inflow_csv}),
              tree.supply, vessels);
  return vessels;
}

}  // namespace

template <class Archive, class S>
void BloodEffect::walk(Archive& a, S& s) {
  auto& c = s.circulation;
  a(c.arteries.time), a(c.arteries.phase), a(c.arteries.area), a(c.arteries.velocity);
  a(c.arteries.windkessel_pressure), a(c.arteries.node_volume), a(c.arteries.leak_volume),
      a(c.arteries.hole_flow);
  a(c.given), a(c.transfused), a(c.crystalloid), a(c.shifted), a(c.cells), a(c.lost_with_cells),
      a(c.drug_comes), a(c.drug_acts);
  a(c.low_time), a(c.arrested), a(s.settings.infusion), a(s.settings.transfusion), a(s.settings.infused);
  a(c.lost), a(c.vessel_lost), a(c.territory_flow), a(c.smoothed_pressure), a(c.rate_tone),
      a(c.resistance_tone), a(c.volume_tone);
  a(c.heart_rate), a(c.output), a(c.filling_pressure), a(c.systolic), a(c.diastolic), a(c.mean);
  a(c.beat_most), a(c.beat_least), a(c.beat_sum), a(c.beat_time), a(c.hole_flow), a(c.degraded);
  a(s.settings.heart_rate), a(s.settings.mean_pressure), a(s.settings.resistance_scale),
      a(s.settings.reflex_scale);
  a(s.kinks.count);
  for (auto& k : s.kinks.each) a(k.place.vessel), a(k.place.station), a(k.place.stretch), a(k.opening);
  auto& w = s.wounds;
  a(w.opening_count), a(w.clamp_count), a(w.next_wound), a(w.refused);
  for (auto& o : w.openings) {
    a(o.wound), a(o.slot), a(o.vessel), a(o.end), a(o.station), a(o.area), a(o.sealed), a(o.clot), a(o.spasm),
        a(o.lost), a(o.flow);
    a(o.object), a(o.ring), a(o.knot);
  }
  for (auto& k : w.clamps) a(k.kind), a(k.vessel), a(k.station), a(k.opening);
  a(s.pulse_dilatation), a(s.opening_station);
}

BloodEffect::BloodEffect(const scene::World& world, const BloodOptions& options,
                         scene::TripleBuffer<BloodFrame>* frames)
    : options_(options),
      circulation_(hd::buildCirculation(vesselsOf(world, options.vessels), options.dx)),
      scratch_(circulation_.model),
      frames_(frames) {
  const auto refuse = [](const char* name, double value, const char* allowed) {
    throw std::invalid_argument(std::string(name) + ": " + std::to_string(value) + " (allowed: " + allowed +
                                ")");
  };
  if (!(options.pulse_dilatation >= 0 && options.pulse_dilatation <= 20))
    refuse("pulse_dilatation", options.pulse_dilatation, "0 to 20");
  if (!(options.frame_rate >= 50 && options.frame_rate <= 1000))
    refuse("frame_rate", options.frame_rate, "50 to 1000 Hz");
  const hd::CirculationModel& m = circulation_.model;
  shown_.assign(m.vesselCount(), 0);
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const std::string& segment = world.description().objects[i].tube.vessel_segment;
    const bool usable = world.model().objects[i].deforms && tubeOf(world, i).ringCount() > 1;
    vessel_of_.push_back(segment.empty() || !usable ? -1 : m.find(segment));
    rest_area_.emplace_back();
    if (vessel_of_.back() < 0) continue;
    shown_[vessel_of_.back()] = 1;
    const net::TubeMap& tube = tubeOf(world, i);
    for (std::size_t r = 0; r < tube.ringCount(); ++r)
      rest_area_.back().push_back(enclosed(world, i, tube, r, ringCentre(world, i, tube, r)));
    if (tube.ringCount() > areas_.size()) centres_.resize(tube.ringCount()), areas_.resize(tube.ringCount());
  }
  auto names = std::make_shared<std::vector<std::string>>();
  for (int v = 0; v < m.vesselCount(); ++v) {
    names_.emplace_back(m.name(v));
    names->push_back(m.name(v));
  }
  frame_names_ = names;
  if (frames_) {
    frames_->forEachSlot(
        [&](BloodFrame& f) { f.vessels.reserve(static_cast<std::size_t>(m.vesselCount())); });
  }
  frame_every_ = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>(1 / (options.frame_rate * world.description().dt) + 0.5));
  inputs_.external_pressure = options.gas_pressure;
  hd::settle(m, inputs_, circulation_.rest, scratch_);
  reset();
}

void BloodEffect::reset() {
  state_ = State{};
  state_.circulation = circulation_.rest;
  state_.pulse_dilatation = options_.pulse_dilatation;
}

void BloodEffect::save(std::vector<std::uint8_t>& bytes) const {
  effects::StateWriter writer(bytes);
  walk(writer, state_);
}

void BloodEffect::adopt(const Effect& effect, const std::vector<std::uint32_t>& objects) {
  const auto* const before = dynamic_cast<const BloodEffect*>(&effect);
  if (before == nullptr || *before->frame_names_ != *frame_names_ ||
      before->state_.circulation.arteries.area.size() != state_.circulation.arteries.area.size())
    return;
  state_ = before->state_;
  std::vector<std::uint8_t> shown(frame_names_->size(), 0), kept = shown;  // per vessel: by the scene before
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (before->vessel_of_[i] < 0) continue;
    const auto vessel = static_cast<std::size_t>(before->vessel_of_[i]);
    shown[vessel] = 1;
    if (objects[i] != scene::kNotAdopted) kept[vessel] = 1;
  }
  bleeding::WoundState& w = state_.wounds;
  int openings = 0, clamps = 0;
  for (int i = 0; i < w.opening_count; ++i) {
    bleeding::Opening o = w.openings[static_cast<std::size_t>(i)];
    if (o.object >= 0) {
      const std::uint32_t now = objects[static_cast<std::size_t>(o.object)];
      if (now == scene::kNotAdopted) continue;
      o.object = static_cast<std::int32_t>(now);
    }
    w.openings[static_cast<std::size_t>(openings++)] = o;
  }
  for (int i = 0; i < w.clamp_count; ++i) {
    const bleeding::Clamp c = w.clamps[static_cast<std::size_t>(i)];
    const auto vessel = static_cast<std::size_t>(c.vessel);
    if (shown[vessel] == 0 || kept[vessel] != 0) w.clamps[static_cast<std::size_t>(clamps++)] = c;
  }
  w.opening_count = openings, w.clamp_count = clamps;
}

bool BloodEffect::restore(const std::uint8_t* bytes, std::size_t count) {
  if (count == 0) {
    reset();
    return true;
  }
  State state = state_;
  effects::StateReader reader(bytes, count);
  walk(reader, state);
  const hd::CirculationModel& m = circulation_.model;
  const auto inside = [&](int vessel, double station) {
    return vessel >= 0 && vessel < m.vesselCount() && station >= 0 && station <= m.length(vessel);
  };
  const hd::State& arteries = state.circulation.arteries;
  const auto each = [](const std::vector<double>& values, auto fits) {
    return std::all_of(values.begin(), values.end(), fits);
  };
  bool good = reader.done() && state.wounds.opening_count >= 0 &&
              state.wounds.opening_count <= bleeding::kMostOpenings && state.wounds.clamp_count >= 0 &&
              state.wounds.clamp_count <= bleeding::kMostClamps && arteries.phase >= 0 &&
              arteries.phase < m.arteries.period &&
              each(arteries.area, [](double area) { return area > 0 && area <= kWidest; }) &&
              each(arteries.velocity, [](double v) { return std::fabs(v) <= kFastest; });
  for (int i = 0; good && i < state.wounds.opening_count; ++i) {
    const auto& o = state.wounds.openings[i];
    good = inside(o.vessel, o.station) && o.sealed >= 0 && o.clot >= 0 && o.spasm >= 0 &&
           (o.object < 0 || (o.object < static_cast<int>(vessel_of_.size()) && vessel_of_[o.object] >= 0)) &&
           o.slot < bleeding::kMostSources && std::abs(static_cast<int>(o.end)) <= 1;
  }
  good = good && state.kinks.count >= 0 && state.kinks.count <= bleeding::kMostPinches;
  for (int i = 0; good && i < state.kinks.count; ++i) {
    const bleeding::Pinch& k = state.kinks.each[static_cast<std::size_t>(i)];
    good = inside(k.place.vessel, k.place.station) && k.opening >= 0 && k.opening <= 1 && k.place.stretch > 0;
  }
  for (int i = 0; good && i < state.wounds.clamp_count; ++i) {
    const bleeding::Clamp& c = state.wounds.clamps[i];
    good = inside(c.vessel, c.station) && c.kind <= bleeding::ClampKind::kCut && c.opening >= 0 &&
           c.opening <= 1;
  }
  if (good) state_ = state;
  return good;
}

double BloodEffect::drained(std::size_t territory) const {
  const hd::CirculationModel& m = circulation_.model;
  const auto& veins = m.vessels.territories[territory].veins;
  double open = 0;
  for (const int v : veins)
    open += 1 - bleeding::closure(static_cast<int>(m.arteries.segments.size()) + v, state_.wounds);
  return veins.empty() ? 1.0 : open / static_cast<double>(veins.size());
}

bleeding::Place BloodEffect::placeOf(const scene::World& world, std::size_t object, double station) const {
  const net::TubeMap& tube = tubeOf(world, object);
  const int vessel = vessel_of_[object];
  const double stretch = circulation_.model.length(vessel) / tube.length();
  const double along = std::clamp(station - tube.station(0), 0.0, tube.length());
  return {vessel, std::min(along * stretch, circulation_.model.length(vessel)), stretch};
}

/// Where a vessel is bent so sharply, or drawn out or pressed so flat, that its lumen is narrow: its
/// narrowest place. At stumps and holes the tissue tells nothing of a lumen.
void BloodEffect::findKinks(const scene::World& world) {
  bleeding::Pinches& kinks = state_.kinks;
  kinks.count = 0;
  for (std::size_t object = 0; object < vessel_of_.size(); ++object) {
    if (vessel_of_[object] < 0) continue;
    const net::TubeMap& tube = tubeOf(world, object);
    const std::size_t rings = tube.ringCount();
    for (std::size_t r = 0; r < rings; ++r) {
      centres_[r] = ringCentre(world, object, tube, r);
      areas_[r] = enclosed(world, object, tube, r, centres_[r]);
    }
    bleeding::Pinch worst;
    worst.opening = bleeding::kNarrows;
    for (std::size_t r = 1; r + 1 < rings; ++r) {
      const double rest = rest_area_[object][r], radius = std::sqrt(rest / kPi);
      double opening = areas_[r] / std::max(rest, 1e-12);
      // The bend over a diameter to each side: shorter ways tell of the net, not of the vessel.
      std::size_t a = r, b = r;
      while (a > 0 && tube.station(r) - tube.station(a) < 2 * radius) --a;
      while (b + 1 < rings && tube.station(b) - tube.station(r) < 2 * radius) ++b;
      const Vector3d in = centres_[r] - centres_[a], out = centres_[b] - centres_[r];
      opening = std::min(opening, bleeding::bent(std::sqrt((unit(out) - unit(in)).squaredNorm())));
      if (opening >= worst.opening) continue;
      const bleeding::Place place = placeOf(world, object, tube.station(r));
      const auto beside = [&](const bleeding::Opening& o) {
        return o.vessel == place.vessel &&
               std::fabs(o.station - place.station) < place.stretch * (2 * radius + bleeding::kSamePlace);
      };
      if (std::none_of(state_.wounds.openings.begin(),
                       state_.wounds.openings.begin() + state_.wounds.opening_count, beside))
        worst = {place, opening};
    }
    if (worst.opening < bleeding::kNarrows && kinks.count < bleeding::kMostPinches)
      kinks.each[static_cast<std::size_t>(kinks.count++)] = worst;
  }
}

/// Jaws that hold a vessel, and tools that press on one, shut it as far as their force is that of the blood
/// in it on the same area: pressure at rest, times the tool's width, times the vessel's diameter.
void BloodEffect::findPinches(const scene::World& world, const scene::StepReport& report) {
  pinches_ = state_.kinks;
  int kinks = pinches_.count;
  const scene::WorldState& state = world.state();
  const auto pinch = [&](std::size_t object, std::uint32_t knot, double force, double width) {
    if (object >= vessel_of_.size() || vessel_of_[object] < 0) return;
    const net::TubeMap& tube = tubeOf(world, object);
    const std::int32_t ring = tube.ringOf(knot);
    if (ring < 0) return;
    const bleeding::Place place = placeOf(world, object, tube.station(static_cast<std::size_t>(ring)));
    const hd::CirculationModel& m = circulation_.model;
    const double pressure =
        m.isVein(place.vessel) ? hd::at(m, state_.circulation, place.vessel, 0).pressure : m.resting_pressure;
    const double area = crossSection(world, object, tube, static_cast<std::size_t>(ring));
    const double needed = pressure * width * 2 * std::sqrt(area / kPi);
    const double opening = std::clamp(1 - force / std::max(needed, 1e-6), 0.0, 1.0);
    if (opening < 1) bleeding::hold({place, opening}, kinks, pinches_);
  };
  for (std::size_t t = 0; t < state.grasps.size(); ++t) {
    const double width =
        2 * (state.proxies[t].tool == tools::ToolKind::Swab ? swabRadius() : interaction::kJawHalfWidth);
    const interaction::Grasp& grasp = state.grasps[t];
    std::size_t last = vessel_of_.size();
    const bool jaws = grasp.active && interaction::hasJaws(state.proxies[t].tool);
    for (int k = 0; jaws && k < grasp.count; ++k) {
      const auto& anchor = grasp.anchors[static_cast<std::size_t>(k)];
      if (anchor.object != last) pinch(last = anchor.object, anchor.knot, grasp.pinch, width);
    }
    const double force = std::sqrt(report.contacts[t].wrench.head<3>().squaredNorm());
    if (grasp.active || !report.contacts[t].in_contact || !(force > 0)) continue;
    const auto of_tool = [&](const scene::ContactSide& side) {
      return side.tool == t && side.triangle < world.contactTriangles(side.object).size();
    };
    const auto corner = [&](const scene::ContactSide& side) {
      return world.contactTriangles(side.object)[side.triangle][0];
    };
    for (const scene::ContactSide& side : state.sides) {
      if (!of_tool(side) || side.object == last) continue;
      last = side.object;
      if (vessel_of_[last] < 0) continue;
      // What the tool presses elsewhere, as with its shaft, does not press here.
      const Vector3d place = world.knotAt(last, corner(side));
      int here = 0, all = 0;
      for (const scene::ContactSide& other : state.sides) {
        if (!of_tool(other)) continue;
        ++all;
        here += (world.knotAt(other.object, corner(other)) - place).squaredNorm() < kPressReach * kPressReach;
      }
      pinch(last, corner(side), force * here / all, width);
    }
  }
}

/// Gauze that presses on openings covers them, whatever comes to them from either side.
void BloodEffect::cover(const scene::World& world, const scene::StepInput& input,
                        const scene::StepReport& report) {
  for (std::size_t t = 0; t < input.tools.size(); ++t) {
    const scene::ContactModel& contact = report.contacts[t];
    if (!input.tools[t].present || input.tools[t].tool != tools::ToolKind::Swab || !contact.in_contact)
      continue;
    const Vector3d place =
        contact.proxy * tools::toolGeometry(tools::ToolKind::Swab).interaction_points.front();
    const double force = std::sqrt(contact.wrench.head<3>().squaredNorm());
    for (int i = 0; i < inputs_.hole_count; ++i) {
      const bleeding::Opening& o = state_.wounds.openings[static_cast<std::size_t>(i)];
      if (o.object < 0 || (world.knotAt(static_cast<std::size_t>(o.object), o.knot) - place).squaredNorm() >
                              bleeding::kSwabReach * bleeding::kSwabReach)
        continue;
      const double pressure = hd::at(circulation_.model, state_.circulation, o.vessel, o.station).pressure -
                              inputs_.external_pressure;
      inputs_.holes[static_cast<std::size_t>(i)].area *= 1 - bleeding::covered(force, pressure, swabRadius());
    }
  }
}

/// A sucker takes the clot from an opening that it touches: a plug as deep as it is wide.
void BloodEffect::suckClots(const scene::World& world, const scene::StepInput& input,
                            const scene::StepReport& report, Feedback& feedback) {
  for (std::size_t t = 0; t < input.tools.size(); ++t) {
    const scene::ToolInput& tool = input.tools[t];
    if (!tool.present || tool.tool != tools::ToolKind::SuctionIrrigator ||
        !(tool.functions & tools::kFunctionSuck))
      continue;
    const Vector3d tip =
        report.contacts[t].step > 0 ? Vector3d(report.contacts[t].proxy.translation()) : tool.position;
    for (int i = 0; i < state_.wounds.opening_count; ++i) {
      bleeding::Opening& o = state_.wounds.openings[static_cast<std::size_t>(i)];
      if (o.clot > 0 && o.object >= 0 &&
          (world.knotAt(static_cast<std::size_t>(o.object), o.knot) - tip).squaredNorm() <
              bleeding::kSuckReach * bleeding::kSuckReach)
        feedback.clots[t] += o.clot * std::sqrt(o.clot), o.clot = 0;
    }
  }
}

void BloodEffect::openAt(const scene::World& world, std::size_t object, double station, double area,
                         const Vector3d* place) {
  const net::TubeMap& tube = tubeOf(world, object);
  bleeding::Opening like;
  like.object = static_cast<std::int32_t>(object);
  const std::size_t ring = tube.nearestRing(station);
  like.ring = static_cast<std::uint32_t>(tube.at(station).ring);
  // Nearest to the place that was hit; an instructor's opening is on top, where it is seen.
  const auto& ring_knots = tube.knots(ring);
  like.knot = ring_knots.front();
  const auto merit = [&](std::uint32_t knot) {
    const Vector3d at = world.knotAt(object, knot);
    return place ? -(at - *place).squaredNorm() : at.z();
  };
  for (const auto knot : ring_knots)
    if (merit(knot) > merit(like.knot)) like.knot = knot;
  // The scene's vessel may be drawn wider than the patient's: the same share of the cross-section is open.
  const bleeding::Place at = placeOf(world, object, station);
  const double whole = crossSection(world, object, tube, ring);
  if (!(whole > 0)) return;
  bleeding::open(circulation_.model, at, area / whole * circulation_.model.lumen(at.vessel, at.station), like,
                 state_.wounds);
}

void BloodEffect::edits(const scene::World& world, std::vector<scene::EditableParameter>& out) const {
  for (const Setting& p : kSettings) out.push_back({"", p.name, p.unit, p.low, p.high});
  for (const hd::Drug& d : hd::kDrugs) out.push_back({"", d.name, d.infused ? "kg/s" : "kg", 0, d.most});
  for (std::size_t i = 0; i < vessel_of_.size(); ++i) {
    if (vessel_of_[i] < 0) continue;
    const std::string& name = world.description().objects[i].name;
    const double length = tubeOf(world, i).length();
    out.push_back({name, "opening_station", "m", 0, length});
    out.push_back({name, "opening_area", "m²", kLeastOpening, kGreatestOpening});
    out.push_back({name, "clip_station", "m", 0, length});
  }
}

void BloodEffect::take(const scene::World& world, const scene::ParameterEdit& edit) {
  if (!std::isfinite(edit.value)) return;
  if (edit.object.empty()) {
    hd::CirculationSettings& s = state_.settings;
    double* const to[] = {&s.heart_rate, &s.mean_pressure, &s.resistance_scale,     &s.reflex_scale,
                          &s.infusion,   &s.transfusion,   &state_.pulse_dilatation};
    static_assert(std::size(to) == std::size(kSettings));
    for (std::size_t i = 0; i < std::size(kSettings); ++i)
      if (edit.parameter == kSettings[i].name)
        *to[i] = std::clamp(edit.value, kSettings[i].low, kSettings[i].high);
    for (std::size_t d = 0; d < hd::kDrugCount; ++d)
      if (edit.parameter == hd::kDrugs[d].name)
        hd::give(static_cast<hd::DrugIndex>(d), std::clamp(edit.value, 0.0, hd::kDrugs[d].most), s,
                 state_.circulation);
    return;
  }
  for (std::size_t i = 0; i < vessel_of_.size(); ++i) {
    if (vessel_of_[i] < 0 || world.description().objects[i].name != edit.object) continue;
    const net::TubeMap& tube = tubeOf(world, i);
    const double station = tube.station(0) + std::clamp(edit.value, 0.0, tube.length());
    if (edit.parameter == "opening_station") state_.opening_station = station;
    if (edit.parameter == "opening_area" && edit.value > 0)
      openAt(world, i, state_.opening_station, std::clamp(edit.value, kLeastOpening, kGreatestOpening),
             nullptr);
    if (edit.parameter == "clip_station")
      bleeding::clamp(circulation_.model, bleeding::ClampKind::kClip, placeOf(world, i, station), 0,
                      state_.wounds);
  }
}

void BloodEffect::take(const scene::World& world, const scene::Event& event) {
  if (event.object >= vessel_of_.size() || vessel_of_[event.object] < 0 || !std::isfinite(event.station))
    return;
  const std::size_t object = event.object;
  const hd::CirculationModel& m = circulation_.model;
  const bleeding::Place at = placeOf(world, object, event.station);
  const bool has_area = std::isfinite(event.area) && event.area > 0;
  using scene::EventKind;
  switch (event.kind) {
    case EventKind::Cut:
    case EventKind::Torn: {
      // What is told is the area of the wall that was cut; what gapes is that share of the lumen.
      const net::TubeMap& tube = tubeOf(world, object);
      const double whole = crossSection(world, object, tube, tube.nearestRing(event.station));
      const double wall = world.description().objects[object].wall_thickness;
      if (has_area && whole > 0)
        openAt(world, object, event.station, cutShare(event.area, wall, whole) * whole, &event.position);
      break;
    }
    case EventKind::Punctured:
    case EventKind::Perforated:
    case EventKind::Exited:
      openAt(world, object, event.station, has_area ? event.area : kNeedleArea, &event.position);
      break;
    case EventKind::Separated:
      openAt(world, object, event.station, 1.0, &event.position);  // more than any vessel: cut through
      break;
    case EventKind::Clipped:
      bleeding::clamp(m, bleeding::ClampKind::kClip, at, 0, state_.wounds);
      break;
    case EventKind::Ligated:
      bleeding::clamp(m, bleeding::ClampKind::kLigature, at, 0, state_.wounds);
      break;
    case EventKind::Unclipped:
      bleeding::release(at, state_.wounds);
      break;
    case EventKind::Coagulated: {
      const net::TubeMap& tube = tubeOf(world, object);
      const double whole = crossSection(world, object, tube, tube.nearestRing(event.station));
      if (!(whole > 0)) break;
      // No area: heat, which closes holes. Area 0: no lumen is left. Else: so much of it was closed.
      const bool heat = std::isnan(event.area);
      const double energy = std::isfinite(event.energy) ? std::max(event.energy, 0.0) : 0.0;
      const double closed = heat ? energy / kSealEnergyPerArea : event.area > 0 ? event.area : 10 * whole;
      bleeding::seal(m, at, closed / whole * m.lumen(at.vessel, at.station), !heat, state_.wounds);
      break;
    }
    default:
      break;
  }
}

void BloodEffect::tellSources(const scene::World& world, Feedback& feedback) const {
  for (int i = 0; i < state_.wounds.opening_count; ++i) {
    const bleeding::Opening& o = state_.wounds.openings[i];
    if (!(o.flow > 0) || o.object < 0 || feedback.sources.size() >= feedback.sources.capacity()) continue;
    const auto object = static_cast<std::size_t>(o.object);
    const net::TubeMap& tube = tubeOf(world, object);
    const std::size_t last = tube.ringCount() - 1;
    const std::size_t ring = std::min<std::size_t>(o.ring, last);
    bleeding::FluidSource source;
    source.slot = o.slot;
    source.wound = o.wound;
    source.vessel = o.vessel;
    source.object = o.object;
    source.area = std::max(o.open(), 1e-9);
    source.flow = o.flow;
    if (o.end == bleeding::End::kWall) {
      // The jet contracts behind a hole, and has the speed that the pressure gives (Torricelli).
      source.area *= circulation_.model.vessels.control.discharge;
      source.position = world.knotAt(object, o.knot);
      source.direction = unit(source.position - ringCentre(world, object, tube, ring));
    } else if (o.end == bleeding::End::kHeart) {
      source.position = ringCentre(world, object, tube, ring);
      source.direction = unit(ring > 0 ? Vector3d(source.position - ringCentre(world, object, tube, ring - 1))
                                       : Vector3d(ringCentre(world, object, tube, 1) - source.position));
    } else {
      const std::size_t behind = std::min(ring + 1, last);
      source.position = ringCentre(world, object, tube, behind);
      source.direction =
          unit(behind < last ? Vector3d(source.position - ringCentre(world, object, tube, behind + 1))
                             : Vector3d(ringCentre(world, object, tube, behind - 1) - source.position));
    }
    feedback.sources.push_back(source);
  }
}

void BloodEffect::step(const scene::World& world, const scene::StepInput& input,
                       const scene::StepReport& report, Feedback& feedback) {
  for (const auto& edit : input.edits) take(world, edit);
  for (const auto& event : report.events) take(world, event);
  inputs_.settings = state_.settings;
  inputs_.external_pressure = feedback.gas.pressure;
  if (world.steps() % kKinksEvery == 0) findKinks(world);
  findPinches(world, report);
  suckClots(world, input, report, feedback);
  bleeding::fill(circulation_.model, state_.wounds, pinches_, inputs_);
  cover(world, input, report);
  const double dt = std::isfinite(input.dt) ? std::clamp(input.dt, 0.0, 0.01) : 0.0;
  hd::step(circulation_.model, inputs_, dt, state_.circulation, scratch_);
  bleeding::book(circulation_.model, state_.circulation, dt, state_.wounds);
  tellSources(world, feedback);
  if (world.steps() % kDilateEvery == 0) {
    for (std::size_t v = 0; v < shown_.size(); ++v) {
      if (!shown_[v] || circulation_.model.isVein(static_cast<int>(v))) continue;
      scene::DilatationInput& told = feedback.dilatations.emplace_back();
      told.vessel_segment = names_[v];
      for (std::size_t i = 0; i < told.dilatation.size(); ++i) {
        const double along = static_cast<double>(i) / (scene::DilatationInput::kPlaces - 1);
        const double d =
            hd::dilatation(circulation_.model, state_.circulation, static_cast<int>(v), along) - 1.0;
        told.dilatation[i] = static_cast<float>(1.0 + std::clamp(state_.pulse_dilatation * d, -0.5, 1.0));
      }
    }
  }
  if (frames_ && world.steps() % frame_every_ == 0) tellFrame(world.steps());
}

void BloodEffect::tellFrame(std::uint64_t step) {
  const hd::CirculationModel& m = circulation_.model;
  const hd::CirculationState& c = state_.circulation;
  BloodFrame& f = frames_->back();
  f.step = step;
  f.heart_rate = c.arrested ? 0 : c.heart_rate;
  f.arrested = c.arrested, f.given = c.given, f.transfused = c.transfused;
  f.haematocrit = hd::haematocrit(m, c), f.vasopressor = hd::drugResistance(m, state_.settings, c);
  f.systolic = c.systolic, f.diastolic = c.diastolic, f.mean = c.mean;
  f.pressure = hd::at(m, c, m.reference, 0.5 * m.length(m.reference)).pressure;
  f.curves = hd::monitorCurves(m, c);
  f.blood_loss = c.lost;
  f.loss_rate = seeping_;
  for (int i = 0; i < state_.wounds.opening_count; ++i) f.loss_rate += state_.wounds.openings[i].flow;
  f.blood_volume = hd::bloodVolume(m, c);
  f.degraded_steps = c.degraded;
  f.refused = state_.wounds.refused;
  f.names = frame_names_;
  f.vessels.resize(static_cast<std::size_t>(m.vesselCount()));
  for (int v = 0; v < m.vesselCount(); ++v) {
    BloodFrame::Vessel& o = f.vessels[static_cast<std::size_t>(v)];
    const hd::Sample middle = hd::at(m, c, v, 0.5 * m.length(v));
    o.pressure_prox = static_cast<float>(hd::at(m, c, v, 0).pressure);
    o.pressure_mid = static_cast<float>(middle.pressure);
    o.pressure_dist = static_cast<float>(hd::at(m, c, v, m.length(v)).pressure);
    o.flow_mid = static_cast<float>(middle.flow);
    o.radius_mid = static_cast<float>(std::sqrt(middle.area / kPi));
    o.dilatation = static_cast<float>(1.0 + state_.pulse_dilatation *
                                                (static_cast<double>(hd::dilatation(m, c, v, 0.5)) - 1.0));
    o.leak = 0;
    o.loss = c.vessel_lost[static_cast<std::size_t>(v)];
    o.closure = static_cast<float>(bleeding::closure(v, state_.wounds));
  }
  for (int i = 0; i < state_.wounds.opening_count; ++i) {
    const auto& o = state_.wounds.openings[i];
    f.vessels[static_cast<std::size_t>(o.vessel)].leak += static_cast<float>(o.flow);
  }
  frames_->publish();
}

}  // namespace vest::simulation

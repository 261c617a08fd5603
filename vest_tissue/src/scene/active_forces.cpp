#include <algorithm>
#include <cmath>

#include "stages.h"
#include "vest_tissue/base/elementary.h"
#include "vest_tissue/motility/motility.h"
#include "vest_tissue/scene/topology.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;

void addForces(Context& c, std::size_t object) {
  const motility::MotilityModel& model = c.model.objects[object].motility;
  const net::TubeMap& tube = c.model.objects[object].tube;
  ObjectState& s = c.state.objects[object];
  std::vector<float>& out = c.scratch.objects[object].active;
  const std::size_t stride = out.size() / 3, rings = tube.ringCount();
  std::fill(out.begin(), out.end(), 0.0f);
  const double ramp = motility::rampAt(model.waves.ramp, c.state.time);
  std::array<double, 2> amplitude{};
  for (std::size_t i = 0; i < 2; ++i) {
    const motility::Wave& w = model.waves.waves[i];
    const std::uint64_t index = 2 * object + i;
    double& phase = s.motility.phase[i];
    phase += c.dt * motility::frequencyAt(w, phase, c.input.seed, index);
    amplitude[i] = w.pressure == 0.0 ? 0.0 : ramp * motility::amplitudeAt(w, phase, c.input.seed, index);
  }
  const auto add = [&](std::uint32_t k, const Vector3d& f) {
    for (int axis = 0; axis < 3; ++axis)
      out[static_cast<std::size_t>(axis) * stride + k] += static_cast<float>(f[axis]);
  };
  // Held over the step, so taken at its predicted middle: from where the knots are now the tension of a ring,
  // which turns with it, would lag by half a step and feed its wall's vibrations (docs/decisions/0011-…).
  const auto placeOf = [&, ahead = 0.5 * c.dt](std::uint32_t k) -> Vector3d {
    return knotPosition(s, k) + ahead * knotVelocity(s, k);
  };
  // A knot that a cut has doubled has its part of the wall, and of the muscle in it, by its mass; one on
  // which both sides of a ring hang is shared by them.
  const bool cut = c.scratch.objects[object].rings.cut();
  const std::vector<double>& mass = c.model.description.objects[object].mass;
  const auto areaOf = [&](std::uint32_t k, const net::CutRings::Ring& other) -> double {
    if (!cut) return model.area[k];
    const std::uint32_t of = originalKnot(s.topology, mass.size(), k);
    const double part = static_cast<double>(row(s, net::Block::kMass)[k]) / mass[of];
    return model.area[of] * part * (std::find(other.begin(), other.end(), k) != other.end() ? 0.5 : 1.0);
  };
  const auto otherSide = [&](std::size_t r, bool above, bool whole) {
    return whole ? net::CutRings::Ring{} : ringNow(c, object, r, !above);
  };
  const auto middleOf = [&](const net::CutRings::Ring& ring) {
    Vector3d sum = Vector3d::Zero();
    for (const auto k : ring) sum += placeOf(k);
    return Vector3d(sum / static_cast<double>(std::max<std::size_t>(ring.count, 1)));
  };
  Vector3d axial_sum = Vector3d::Zero();
  double axial_area = 0.0;
  Vector3d before = middleOf(ringNow(c, object, 0, true)), here = before;
  for (std::size_t r = 0; r < rings; ++r) {
    const double place = static_cast<double>(r) / static_cast<double>(rings);
    const double radial = amplitude[0] * motility::waveAt(model.waves.waves[0], place, s.motility.phase[0]);
    const double axial = amplitude[1] * motility::waveAt(model.waves.waves[1], place, s.motility.phase[1]);
    const bool whole = !cut || c.scratch.objects[object].rings.whole(tube, r);
    for (const bool above : {true, false}) {
      if (whole && !above) continue;
      const net::CutRings::Ring knots = ringNow(c, object, r, above), other = otherSide(r, above, whole);
      if (knots.count == 0) continue;
      if (cut)
        here = middleOf(knots),
        before = r > 0 && (whole || !above) ? middleOf(ringNow(c, object, r - 1, true)) : here;
      const Vector3d after =
          r + 1 < rings && (whole || above) ? middleOf(ringNow(c, object, r + 1, false)) : here;
      Vector3d along = after - before, mean = Vector3d::Zero();
      along /= std::max(std::sqrt(along.squaredNorm()), 1e-9);
      // Of each knot once, where the ring has room.
      constexpr std::size_t kRoom = 48;
      std::array<Vector3d, kRoom> places, pressed;
      std::array<double, kRoom> areas;
      const bool kept = knots.count <= kRoom;
      for (std::size_t i = 0; kept && i < knots.count; ++i)
        places[i] = placeOf(knots.knots[i]), areas[i] = areaOf(knots.knots[i], other);
      const auto placeAt = [&](std::size_t i) { return kept ? places[i] : placeOf(knots.knots[i]); };
      const auto areaAt = [&](std::size_t i) { return kept ? areas[i] : areaOf(knots.knots[i], other); };
      const auto outwards = [&](std::size_t i) -> Vector3d {
        Vector3d out_of = placeAt(i) - here;
        out_of -= out_of.dot(along) * along;
        const double length = std::sqrt(out_of.squaredNorm());
        return length > 1e-9 ? Vector3d(out_of * (areaAt(i) / length)) : Vector3d(Vector3d::Zero());
      };
      const double n = static_cast<double>(knots.count);
      if (knots.count >= 3 && radial > 0.0) {  // dilates: pressed outwards
        for (std::size_t i = 0; i < knots.count; ++i) {
          const Vector3d out_of = outwards(i);
          if (kept) pressed[i] = out_of;
          mean += out_of / n;
        }
        for (std::size_t i = 0; i < knots.count; ++i)
          add(knots.knots[i], radial * ((kept ? pressed[i] : outwards(i)) - mean));
      } else if (knots.count >= 3 && radial < 0.0) {  // contracts: tension around it
        double area = 0.0;
        for (std::size_t i = 0; i < knots.count; ++i) area += areaAt(i) / n;
        const double tension = -radial * area / (2.0 * base::sineOfTurns(0.5 / n));
        for (std::size_t i = 0; i < knots.count; ++i) {
          if (!knots.joins(i)) continue;  // a slit
          const std::size_t next = (i + 1) % knots.count;
          const std::uint32_t p = knots.knots[i], q = knots.knots[next];
          const Vector3d d = placeAt(next) - placeAt(i);
          const double length = std::sqrt(d.squaredNorm());
          if (!(length > 1e-9)) continue;
          add(p, tension / length * d);
          add(q, -tension / length * d);
        }
      }
      for (std::size_t i = 0; i < knots.count; ++i) {
        const Vector3d f = axial * areaAt(i) * along;
        axial_sum += f;
        axial_area += areaAt(i);
        add(knots.knots[i], f);
      }
      before = here;
      here = after;
    }
  }
  if (!(axial_area > 0.0)) return;
  axial_sum /= axial_area;
  for (std::size_t r = 0; r < rings; ++r) {
    const bool whole = !cut || c.scratch.objects[object].rings.whole(tube, r);
    for (const bool above : {true, false}) {
      if (whole && !above) continue;
      for (const auto k : ringNow(c, object, r, above))
        add(k, -areaOf(k, otherSide(r, above, whole)) * axial_sum);
    }
  }
}

}  // namespace

void contract(Context& c, std::size_t object) {
  if (!c.scratch.objects[object].active.empty()) addForces(c, object);
}

}  // namespace vest::scene

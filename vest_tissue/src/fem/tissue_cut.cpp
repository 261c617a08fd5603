#include "vest_tissue/fem/tissue_cut.h"

#include <algorithm>

namespace vest::fem {
namespace {

int cornerOf(const TissueState& s, std::uint32_t element, Index knot) {
  for (int c = 0; c < 4; ++c)
    if (s.corner[element][static_cast<std::size_t>(c)] == knot) return c;
  return -1;
}

}  // namespace

std::array<Index, 3> faceKnots(const TissueState& s, std::uint32_t code) {
  const auto& c = s.corner[code / 4];
  const int* const f = kFaces[code % 4];
  return {c[static_cast<std::size_t>(f[0])], c[static_cast<std::size_t>(f[1])],
          c[static_cast<std::size_t>(f[2])]};
}

bool openFace(const TissueModel& t, TissueState& s, std::uint32_t code) {
  const std::uint32_t e = code / 4, f = code % 4, other = t.neighbours[e][f];
  if (other == kNoSlot || (s.open[e] >> f & 1u) != 0) return false;
  s.open[e] = static_cast<std::uint8_t>(s.open[e] | 1u << f);
  for (std::uint32_t g = 0; g < 4; ++g) {
    if (t.neighbours[other][g] == e) s.open[other] = static_cast<std::uint8_t>(s.open[other] | 1u << g);
  }
  ++s.revision;
  return true;
}

bool divideKnots(const TissueModel& t, TissueState& s, const std::vector<Index>& knots,
                 std::vector<Doubling>& out) {
  const Model& m = *t.model;
  bool room = true;
  for (const Index knot : knots) {
    const Index o = s.origin[knot];
    std::array<std::uint32_t, kMostIncident> element{}, group{};
    std::size_t count = 0;
    for (std::size_t k = m.incidence_start[o]; k < m.incidence_start[o + 1]; ++k) {
      const std::uint32_t e = m.incidence[k] / 4;
      if (cornerOf(s, e, knot) < 0) continue;
      if (count == kMostIncident) break;
      element[count] = e;  // ascending
      group[count] = static_cast<std::uint32_t>(count);
      ++count;
    }
    if (count == kMostIncident) {
      room = false;
      continue;
    }
    const auto find = [&](std::uint32_t g) {
      while (group[g] != g) g = group[g] = group[group[g]];
      return g;
    };
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t e = element[i];
      for (std::uint32_t f = 0; f < 4; ++f) {
        const std::uint32_t other = t.neighbours[e][f];
        if (other == kNoSlot || other < e || (s.open[e] >> f & 1u) != 0 || s.corner[e][f] == knot) continue;
        const auto at =
            std::lower_bound(element.begin(), element.begin() + static_cast<std::ptrdiff_t>(count), other);
        if (at == element.begin() + static_cast<std::ptrdiff_t>(count) || *at != other) continue;
        const std::uint32_t a = find(static_cast<std::uint32_t>(i)),
                            b = find(static_cast<std::uint32_t>(at - element.begin()));
        group[std::max(a, b)] = std::min(a, b);
      }
    }
    const auto centreOf = [&](std::uint32_t g) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int n = 0;
      for (std::size_t i = 0; i < count; ++i) {
        if (find(static_cast<std::uint32_t>(i)) != g) continue;
        for (const Index k : s.corner[element[i]])
          if (k != knot) sum += s.x[k] - s.x[knot], ++n;
      }
      return Eigen::Vector3d(sum / std::max(n, 1));
    };
    const Eigen::Vector3d home = count > 0 ? centreOf(0) : Eigen::Vector3d(Eigen::Vector3d::Zero());
    for (std::uint32_t g = 1; g < count; ++g) {
      if (find(g) != g) continue;
      if (s.x.size() == s.x.capacity() || out.size() == out.capacity()) {
        room = false;
        break;
      }
      const Index copy = static_cast<Index>(s.x.size());
      const Eigen::Vector3d away = centreOf(g) - home;
      double mass = 0.0;
      for (std::size_t i = g; i < count; ++i) {
        if (find(static_cast<std::uint32_t>(i)) != g) continue;
        const std::uint32_t e = element[i];
        mass += m.description.materialOf(e).density * m.elements[e].volume / 4.0;
        s.corner[e][static_cast<std::size_t>(cornerOf(s, e, knot))] = copy;
      }
      const Eigen::Vector3d x = s.x[knot], v = s.v[knot];
      s.x.push_back(x), s.v.push_back(v), s.mass.push_back(mass);
      s.origin.push_back(o), s.knot_element.push_back(element[g]);
      s.mass[knot] -= mass;
      out.push_back({knot, copy, away});
    }
    // What is left keeps the smallest element; its mass is summed anew, so that no rounding gathers.
    double mass = 0.0;
    bool first = true;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t e = element[i];
      if (cornerOf(s, e, knot) < 0) continue;
      mass += m.description.materialOf(e).density * m.elements[e].volume / 4.0;
      if (first) s.knot_element[knot] = e;
      first = false;
    }
    if (!first) s.mass[knot] = mass;
  }
  return room;
}

std::uint32_t tissueParts(const TissueModel& t, const TissueState& s, std::vector<std::uint32_t>& root) {
  const std::uint32_t elements = static_cast<std::uint32_t>(s.corner.size());
  for (std::uint32_t e = 0; e < elements; ++e) root[e] = e;
  const auto find = [&](std::uint32_t e) {
    while (root[e] != e) e = root[e] = root[root[e]];
    return e;
  };
  std::uint32_t parts = elements;
  for (std::uint32_t e = 0; e < elements; ++e) {
    for (std::uint32_t f = 0; f < 4; ++f) {
      const std::uint32_t other = t.neighbours[e][f];
      if (other == kNoSlot || other < e || (s.open[e] >> f & 1u) != 0) continue;
      const std::uint32_t a = find(e), b = find(other);
      if (a == b) continue;
      root[std::max(a, b)] = std::min(a, b);
      --parts;
    }
  }
  return parts;
}

void useFactor(TissueState& s) {
  if (s.factored) return;
  for (auto& v : s.v) v.setZero();
  s.factored = true;
}

Description cutDescription(const TissueModel& t, const TissueState& s) {
  Description d = t.model->description;
  d.nodes.clear();
  d.fixed.clear();
  d.loads.clear();
  d.prescribed.clear();
  const Model& m = *t.model;
  for (Index k = 0; k < s.x.size(); ++k) {
    const Index o = s.origin[k];
    d.nodes.push_back(m.description.nodes[o]);
    if (m.unknown[o] < 0) d.fixed.push_back(k);
    if (m.load[o].squaredNorm() > 0.0) d.loads.push_back({k, (s.mass[k] / m.mass[o]) * m.load[o]});
  }
  d.tetrahedra = s.corner;
  return d;
}

}  // namespace vest::fem

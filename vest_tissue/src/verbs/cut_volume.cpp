#include "cut_job.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

constexpr double kLeastPart =
    0.05;  ///< of the organ: smaller parts keep their shape by their links alone (tuned)

net::ElementArrays positions(const CutJob& j) {
  return {row(j.s, Block::X),
          row(j.s, Block::Y),
          row(j.s, Block::Z),
          nullptr,
          nullptr,
          nullptr,
          nullptr,
          nullptr,
          nullptr};
}

/// Closes the surface where the cut, or a tear before it, opened it: a fan of triangles over each rim.
void closeRims(CutJob& j, net::Volume& v, std::uint32_t part) {
  auto& rim = j.k.rim;
  rim.clear();
  for (std::size_t n = 0; n < j.s.triangles.size(); ++n) {
    const auto& t = j.s.triangles[n];
    if (j.s.triangle_alive[n] == 0 || j.k.part[t[0]] != part) continue;
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t[e], b = t[(e + 1) % 3];
      bool neighbour = false;
      for (const std::uint32_t* beside = j.begin(a); beside != j.end(a) && !neighbour; ++beside) {
        const auto& o = j.s.triangles[*beside];
        for (std::size_t i = 0; i < 3; ++i) neighbour = neighbour || (o[i] == b && o[(i + 1) % 3] == a);
      }
      if (!neighbour) rim.push_back({a, b});
    }
  }
  while (!rim.empty()) {
    const std::uint32_t first = rim.back()[0];
    std::uint32_t at = rim.back()[1];
    rim.pop_back();
    while (at != first) {
      std::size_t next = rim.size();
      for (std::size_t i = rim.size(); i-- > 0;)
        if (rim[i][0] == at) next = i;
      if (next == rim.size()) break;  // an open surface: nothing to close
      const std::uint32_t to = rim[next][1];
      rim[next] = rim.back();
      rim.pop_back();
      if (to != first && v.triangles.size() < v.triangles.capacity()) v.triangles.push_back({first, to, at});
      at = to;
    }
  }
}

double volumeAtRest(const CutJob& j, const net::Volume& v) {
  if (v.triangles.empty()) return 0.0;
  const Vector3d o = j.rest(v.triangles[0][0]);
  double six = 0.0;
  for (const auto& t : v.triangles) six += (j.rest(t[0]) - o).dot((j.rest(t[1]) - o).cross(j.rest(t[2]) - o));
  return six / 6.0;
}

}  // namespace

/// A hollow organ that is open holds no pressure. Solid tissue stays as little compressible as it was: each
/// part gets a volume of its own, closed over the face of the cut, with a bulk modulus by its share, so that
/// the step's bound still holds. What was stored and is not any more is lost.
void divideVolumes(CutJob& j) {
  auto& volumes = j.s.elements.volumes;
  const auto& start = j.c.model.start.objects[j.object].elements.volumes;
  if (volumes.empty() || (j.constants.hollow && j.cut.opened)) return;
  const double before = net::volumeEnergy(volumes, positions(j));
  j.cut.opened = true;
  // Each with every knot: the solver keeps the gradient of a single one per knot.
  const bool divides = !j.constants.hollow && start.size() == 1 && volumes[0].bulk_modulus > 0.0f;
  std::size_t count = 0;
  for (std::uint32_t knot = 0; divides && knot < j.s.block.knots(); ++knot) {
    if (j.k.part[knot] != knot) continue;
    if (count == volumes.size()) {
      if (j.cut.spare.empty()) break;
      volumes.push_back(std::move(j.cut.spare.back()));
      j.cut.spare.pop_back();
    }
    net::Volume& v = volumes[count];
    v.triangles.clear();
    for (std::size_t n = 0; n < j.s.triangles.size(); ++n) {
      const auto& t = j.s.triangles[n];
      if (j.s.triangle_alive[n] != 0 && j.k.part[t[0]] == knot) v.triangles.push_back({t[0], t[1], t[2]});
    }
    closeRims(j, v, knot);
    const double rest = volumeAtRest(j, v);
    if (rest < kLeastPart * start[0].rest) continue;
    v.rest = static_cast<float>(rest);
    v.bulk_modulus = static_cast<float>(start[0].bulk_modulus * std::min(1.0, rest / start[0].rest));
    v.knots.clear();
    for (std::uint32_t i = 0; i < j.s.block.knots(); ++i) v.knots.push_back(i);
    ++count;
  }
  for (std::size_t i = count; i < volumes.size(); ++i)
    volumes[i].bulk_modulus = 0.0f, volumes[i].triangles.clear();
  j.c.state.energy.dissipated += before - net::volumeEnergy(volumes, positions(j));
}

}  // namespace vest::scene

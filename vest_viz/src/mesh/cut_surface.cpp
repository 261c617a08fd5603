#include "vest_viz/mesh/cut_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "vest_viz/mesh/store.h"

namespace vest::mesh {
namespace {

/// An edge of cut faces; `rim` where other layers or nothing lie on its other side.
struct Edge {
  std::uint32_t a, b;
  bool rim;
};

bool dead(const std::uint32_t* v) {
  return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
}

std::vector<Edge> edgesOfCutFaces(const std::vector<std::uint32_t>& triangles,
                                  const std::vector<std::uint16_t>& layer) {
  std::vector<Edge> all;
  for (std::size_t t = 0; t < layer.size(); ++t) {
    const std::uint32_t* v = &triangles[3 * t];
    if (layer[t] != kCutFace || dead(v)) continue;
    for (std::size_t k = 0; k < 3; ++k)
      all.push_back({std::min(v[k], v[(k + 1) % 3]), std::max(v[k], v[(k + 1) % 3]), true});
  }
  std::sort(all.begin(), all.end(),
            [](const Edge& x, const Edge& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
  std::vector<Edge> edges;
  for (const Edge& e : all) {
    if (!edges.empty() && edges.back().a == e.a && edges.back().b == e.b)
      edges.back().rim = false;
    else
      edges.push_back(e);
  }
  return edges;
}

}  // namespace

void CutSurface::build(const Object& object) {
  const std::vector<std::uint32_t>& triangles = object.triangles;
  const std::vector<std::uint16_t>& layer = object.triangle_layer;
  const std::size_t vertices = object.vertexCount();
  moved_.clear(), start_.clear(), neighbours_.clear(), dropped_.clear();
  if (std::find(layer.begin(), layer.end(), kCutFace) == layer.end()) return;
  findPieces(object);
  const std::vector<Edge> edges = edgesOfCutFaces(triangles, layer);
  std::vector<std::uint8_t> on_rim(vertices, 0);
  std::vector<std::uint32_t> count(vertices, 0);
  for (const Edge& e : edges)
    if (e.rim) on_rim[e.a] = on_rim[e.b] = 1;
  const auto each = [&](auto&& take) {
    for (const Edge& e : edges) {
      if (e.rim || on_rim[e.a] == 0) take(e.a, e.b);
      if (e.rim || on_rim[e.b] == 0) take(e.b, e.a);
    }
  };
  each([&](std::uint32_t v, std::uint32_t) { ++count[v]; });
  std::vector<std::uint32_t> row(vertices, 0);
  start_.push_back(0);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (count[v] < 2) continue;  // an end stays
    row[v] = static_cast<std::uint32_t>(moved_.size()) + 1;
    moved_.push_back(v);
    start_.push_back(start_.back() + count[v]);
  }
  neighbours_.resize(start_.back());
  std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
  each([&](std::uint32_t v, std::uint32_t w) {
    if (row[v] != 0) neighbours_[next[row[v] - 1]++] = w;
  });
}

void CutSurface::findPieces(const Object& object) {
  const std::vector<std::uint32_t>& triangles = object.triangles;
  const std::size_t vertices = object.vertexCount();
  // Vertices, then knots: what hangs on the same knots is one piece, also where no edge joins skin and wall.
  std::vector<std::uint32_t> parent(vertices + object.knot_count);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (std::uint32_t v = 0; v < vertices; ++v)
    for (std::uint32_t k = object.binding_start[v]; k < object.binding_start[v + 1]; ++k)
      parent[root(v)] = root(static_cast<std::uint32_t>(vertices) + object.binding_knots[k]);
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    if (dead(&triangles[t])) continue;
    parent[root(triangles[t])] = root(triangles[t + 1]);
    parent[root(triangles[t + 1])] = root(triangles[t + 2]);
  }
  std::vector<std::uint32_t> size(parent.size(), 0);
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
    if (!dead(&triangles[t])) ++size[root(triangles[t])];
  // Of an object that is hardly larger all is drawn.
  if (*std::max_element(size.begin(), size.end()) < 4 * kLeast) return;
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3)
    if (!dead(&triangles[t]) && size[root(triangles[t])] < kLeast)
      dropped_.push_back(static_cast<std::uint32_t>(t / 3));
}

void CutSurface::smooth(float* p) const {
  if (moved_.empty()) return;
  place_.resize(3 * moved_.size());
  next_.resize(place_.size());
  const auto at = [p](std::uint32_t v) { return p + 3 * static_cast<std::size_t>(v); };
  for (std::size_t i = 0; i < moved_.size(); ++i) std::copy_n(at(moved_[i]), 3, &place_[3 * i]);
  reach_.resize(moved_.size());
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    float sum = 0;
    for (std::uint32_t k = start_[i]; k < start_[i + 1]; ++k) {
      const float *a = at(moved_[i]), *b = at(neighbours_[k]);
      sum += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    }
    reach_[i] = kMost * sum / static_cast<float>(start_[i + 1] - start_[i]);
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      float mean[3] = {0, 0, 0};
      for (std::uint32_t k = start_[i]; k < start_[i + 1]; ++k)
        for (std::size_t d = 0; d < 3; ++d) mean[d] += at(neighbours_[k])[d];
      const float share = 0.5f / static_cast<float>(start_[i + 1] - start_[i]);
      for (std::size_t d = 0; d < 3; ++d) next_[3 * i + d] = 0.5f * at(moved_[i])[d] + share * mean[d];
    }
    for (std::size_t i = 0; i < moved_.size(); ++i) std::copy_n(&next_[3 * i], 3, at(moved_[i]));
  }
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    float* q = at(moved_[i]);
    const float* from = &place_[3 * i];
    const float way = std::hypot(q[0] - from[0], q[1] - from[1], q[2] - from[2]);
    if (way <= reach_[i]) continue;
    for (std::size_t d = 0; d < 3; ++d) q[d] = from[d] + (q[d] - from[d]) * (reach_[i] / way);
  }
}

}  // namespace vest::mesh

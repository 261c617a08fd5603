#include "vest_tissue/volume/lattice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "place_text.h"

namespace vest::volume {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostWork = 1000000000;  // looks at triangles: seconds (assumed)

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument(what);
}

/// Grid of cubes with a label each; 0: left out.
struct Cubes {
  std::array<int, 3> size{};
  std::vector<std::uint16_t> label;
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(i);
  }
};

Cubes makeCubes(const char* what, const Vector3d& extent, double cell) {
  if (!(cell > 0.0) || !std::isfinite(cell)) refuse("cell must be > 0, m");
  Cubes c;
  double product = 1.0;
  for (int a = 0; a < 3; ++a) {
    const double count = std::max(1.0, std::ceil(extent[a] / cell - 1e-9));
    product *= count;
    if (!(product <= static_cast<double>(kMostCubes))) {
      std::ostringstream text;
      const double most = cell * std::cbrt(static_cast<double>(kMostCubes));
      text << what << " of the size (" << extent[0] << ", " << extent[1] << ", " << extent[2]
           << ") m with cells of " << cell << " m needs more than " << kMostCubes
           << " cubes, which are a mesh of the size (" << most << ", " << most << ", " << most
           << ") m; allowed: larger cells, or less to fill";
      refuse(text.str());
    }
    c.size[static_cast<std::size_t>(a)] = static_cast<int>(count);
  }
  c.label.assign(static_cast<std::size_t>(product), 0);
  return c;
}

/// Five tetrahedra per cube: one in the middle, one at every second corner.
template <class Place>
Lattice fill(const Cubes& c, Place place) {
  Lattice lattice;
  std::vector<Index> number(static_cast<std::size_t>(c.size[0] + 1) *
                                static_cast<std::size_t>(c.size[1] + 1) *
                                static_cast<std::size_t>(c.size[2] + 1),
                            ~0u);
  const auto node = [&](int i, int j, int k) {
    Index& n = number[(static_cast<std::size_t>(k) * static_cast<std::size_t>(c.size[1] + 1) +
                       static_cast<std::size_t>(j)) *
                          static_cast<std::size_t>(c.size[0] + 1) +
                      static_cast<std::size_t>(i)];
    if (n == ~0u) {
      n = static_cast<Index>(lattice.nodes.size());
      lattice.nodes.push_back(place(i, j, k));
    }
    return n;
  };
  constexpr int kEven[5][4] = {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 6, 3}, {4, 0, 5, 6}, {7, 3, 6, 5}};
  constexpr int kOdd[5][4] = {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}};
  for (int k = 0; k < c.size[2]; ++k) {
    for (int j = 0; j < c.size[1]; ++j) {
      for (int i = 0; i < c.size[0]; ++i) {
        const std::uint16_t label = c.label[c.index(i, j, k)];
        if (label == 0) continue;
        std::array<Index, 8> corner{};
        for (int n = 0; n < 8; ++n)
          corner[static_cast<std::size_t>(n)] = node(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2 & 1));
        for (const auto& t : (i + j + k) % 2 == 0 ? kEven : kOdd) {
          std::array<Index, 4> tet{
              corner[static_cast<std::size_t>(t[0])], corner[static_cast<std::size_t>(t[1])],
              corner[static_cast<std::size_t>(t[2])], corner[static_cast<std::size_t>(t[3])]};
          const auto& x = lattice.nodes;
          if ((x[tet[1]] - x[tet[0]]).dot((x[tet[2]] - x[tet[0]]).cross(x[tet[3]] - x[tet[0]])) < 0.0)
            std::swap(tet[2], tet[3]);
          lattice.tetrahedra.push_back(tet);
          lattice.label.push_back(label);
        }
      }
    }
  }
  if (lattice.tetrahedra.empty())
    refuse("no cube is filled; allowed: smaller cells, or an image with labels");
  return lattice;
}

/// Each edge has its opposite once: the surface is closed, and nowhere more than two triangles meet at an
/// edge.
void checkClosed(const Surface& s) {
  struct Edge {
    Index low, high;
    std::uint8_t back;
    bool operator<(const Edge& e) const {
      return std::tie(low, high, back) < std::tie(e.low, e.high, e.back);
    }
  };
  std::vector<Edge> edges;
  edges.reserve(3 * s.triangles.size());
  for (const auto& t : s.triangles) {
    for (std::size_t e = 0; e < 3; ++e) {
      const Index a = t[e], b = t[(e + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a > b});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  for (std::size_t i = 0, next = 0; i < edges.size(); i = next) {
    std::size_t there = 0, back = 0;
    for (next = i;
         next < edges.size() && edges[next].low == edges[i].low && edges[next].high == edges[i].high; ++next)
      ++(edges[next].back ? back : there);
    if (there > 1 && there == back) {
      refuse("the surface is pinched: " + std::to_string(there + back) + " triangles meet at the edge from " +
             text(s.vertices[edges[i].low]) + " to " + text(s.vertices[edges[i].high]) +
             "; allowed: two at each edge");
    }
    open += there > back ? there - back : back - there;
  }
  if (open > 0 || s.triangles.empty()) {
    refuse("the surface is not closed: " + std::to_string(open) +
           " edges have no triangle on their other side; allowed: closed surfaces, counter-clockwise from "
           "outside");
  }
}

/// The triangles around each vertex are one fan: edge by edge one comes from each of them to each other.
void checkFans(const Surface& s) {
  std::vector<Index> root(3 * s.triangles.size());
  for (Index i = 0; i < root.size(); ++i) root[i] = i;
  const auto find = [&root](Index i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  struct Side {
    Index from, to, corner_from, corner_to;
  };
  std::vector<Side> sides;
  sides.reserve(root.size());
  for (Index t = 0; t < s.triangles.size(); ++t) {
    for (Index e = 0; e < 3; ++e) {
      const Index f = (e + 1) % 3;
      sides.push_back({s.triangles[t][e], s.triangles[t][f], 3 * t + e, 3 * t + f});
    }
  }
  const auto before = [](const Side& a, const Side& b) {
    return std::tie(a.from, a.to) < std::tie(b.from, b.to);
  };
  std::sort(sides.begin(), sides.end(), before);
  for (const Side& side : sides) {  // with the triangle on the other side, as checkClosed() found it
    const auto other = std::lower_bound(sides.begin(), sides.end(), Side{side.to, side.from, 0, 0}, before);
    root[find(side.corner_from)] = find(other->corner_to);
    root[find(side.corner_to)] = find(other->corner_from);
  }
  std::vector<Index> fan(s.vertices.size(), ~0u);
  for (Index c = 0; c < root.size(); ++c) {
    Index& of_vertex = fan[s.triangles[c / 3][c % 3]];
    const Index is = find(c);
    if (of_vertex == ~0u) of_vertex = is;
    if (of_vertex != is)
      refuse("the surface is pinched: it meets itself at the vertex " +
             text(s.vertices[s.triangles[c / 3][c % 3]]) +
             "; allowed: one ring of triangles around each vertex");
  }
}

void checkOutside(const Surface& s) {
  double six = 0.0;
  const Vector3d o = s.vertices[s.triangles[0][0]];
  for (const auto& t : s.triangles)
    six += (s.vertices[t[0]] - o).dot((s.vertices[t[1]] - o).cross(s.vertices[t[2]] - o));
  if (!(six > 0.0)) {
    std::ostringstream out;
    out << "the surface is inside out: its volume is " << six / 6.0
        << "; allowed: counter-clockwise from outside, so that the volume is positive (turn its triangles "
           "round)";
    refuse(out.str());
  }
}

/// Crossings of the line (y, z) with the surface: x, and +1 where it comes in.
struct Crossing {
  double x;
  int in;
};

/// Triangles that a plane z crosses.
void slab(const Surface& s, double z, std::vector<Index>& out) {
  out.clear();
  for (Index t = 0; t < s.triangles.size(); ++t) {
    const auto& k = s.triangles[t];
    const double a = s.vertices[k[0]].z(), b = s.vertices[k[1]].z(), c = s.vertices[k[2]].z();
    if (std::max({a, b, c}) >= z && std::min({a, b, c}) <= z) out.push_back(t);
  }
}

void crossings(const Surface& s, const std::vector<Index>& among, double y, double z,
               std::vector<Crossing>& out) {
  out.clear();
  for (const Index of : among) {
    const auto& t = s.triangles[of];
    const Vector3d &a = s.vertices[t[0]], &b = s.vertices[t[1]], &c = s.vertices[t[2]];
    if (std::min({a.y(), b.y(), c.y()}) > y || std::max({a.y(), b.y(), c.y()}) < y) continue;
    // Point in polygon with half-open edges: triangles that share an edge never both count a point on it.
    bool inside = false;
    for (const auto& [p, q] : {std::pair{&a, &b}, std::pair{&b, &c}, std::pair{&c, &a}}) {
      if ((p->z() > z) == (q->z() > z)) continue;
      const bool turned = p->z() > q->z();  // the same numbers from both sides
      const Vector3d &low = turned ? *q : *p, &high = turned ? *p : *q;
      if (y < low.y() + (z - low.z()) * (high.y() - low.y()) / (high.z() - low.z())) inside = !inside;
    }
    if (!inside) continue;
    const Vector3d n = (b - a).cross(c - a);
    if (n.x() == 0.0) continue;
    out.push_back({a.x() - (n.y() * (y - a.y()) + n.z() * (z - a.z())) / n.x(), n.x() < 0.0 ? 1 : -1});
  }
  std::sort(out.begin(), out.end(), [](const Crossing& p, const Crossing& q) { return p.x < q.x; });
}

}  // namespace

std::uint16_t LabelledImage::nearest(const Vector3d& place) const {
  std::array<std::uint32_t, 3> v{};
  for (int a = 0; a < 3; ++a) {
    const double at = place[a] / spacing[a] + 0.5;
    if (!(at >= 0.0 && at < static_cast<double>(size[static_cast<std::size_t>(a)]))) return 0;
    v[static_cast<std::size_t>(a)] = static_cast<std::uint32_t>(at);
  }
  return at(v[0], v[1], v[2]);
}

Lattice fillImage(const LabelledImage& image, double cell) {
  Vector3d extent;
  for (int a = 0; a < 3; ++a) extent[a] = image.spacing[a] * image.size[static_cast<std::size_t>(a)];
  Cubes c = makeCubes("an image", extent, cell);
  // The grid is centred on the image; places below are in its axes, from the centre of the first voxel.
  Vector3d low;
  for (int a = 0; a < 3; ++a)
    low[a] = 0.5 * (extent[a] - image.spacing[a]) - 0.5 * cell * c.size[static_cast<std::size_t>(a)];
  std::map<std::uint16_t, int> votes;
  for (int k = 0; k < c.size[2]; ++k) {
    for (int j = 0; j < c.size[1]; ++j) {
      for (int i = 0; i < c.size[0]; ++i) {
        votes.clear();
        for (int s = 0; s < 64; ++s) {
          const Vector3d at(i + (s % 4 + 0.5) / 4, j + (s / 4 % 4 + 0.5) / 4, k + (s / 16 + 0.5) / 4);
          ++votes[image.nearest(low + cell * at)];
        }
        if (votes[0] > 32) continue;
        int most = 0;
        for (const auto& [label, count] : votes) {
          if (label == 0 || count <= most) continue;
          most = count;
          c.label[c.index(i, j, k)] = label;
        }
      }
    }
  }
  return fill(c, [&](int i, int j, int k) -> Vector3d {
    return image.origin + image.direction * (low + cell * Vector3d(i, j, k));
  });
}

Lattice fillSurface(const Surface& s, double cell) {
  for (const Vector3d& v : s.vertices)
    if (!v.allFinite()) refuse("the surface has a vertex that is not finite");
  Vector3d low = Vector3d::Constant(1e300), high = -low;
  for (const auto& t : s.triangles) {
    for (const Index n : t) {
      if (n >= s.vertices.size()) refuse("the surface names a vertex that does not exist");
      low = low.cwiseMin(s.vertices[n]), high = high.cwiseMax(s.vertices[n]);
    }
  }
  // Before its other faults: one vertex far away opens a surface, too.
  Cubes c = makeCubes("a surface", high - low, cell);
  checkClosed(s);
  checkFans(s);
  checkOutside(s);
  for (int a = 0; a < 3; ++a)
    low[a] = 0.5 * (low[a] + high[a]) - 0.5 * cell * c.size[static_cast<std::size_t>(a)];
  std::vector<std::uint8_t> inside(c.label.size(), 0);
  std::vector<Crossing> line;
  std::vector<Index> near;
  std::size_t work = 0;
  for (int k = 0; k < 2 * c.size[2]; ++k) {
    const double z = low.z() + cell * (k + 0.5) / 2;
    slab(s, z, near);
    work += s.triangles.size() + near.size() * 2 * static_cast<std::size_t>(c.size[1]);
    if (work > kMostWork)
      refuse("the surface has " + std::to_string(s.triangles.size()) +
             " triangles, too many for this cell; allowed: a coarser surface, or larger cells");
    for (int j = 0; j < 2 * c.size[1]; ++j) {
      crossings(s, near, low.y() + cell * (j + 0.5) / 2, z, line);
      std::size_t next = 0;
      int winding = 0;
      for (int i = 0; i < 2 * c.size[0]; ++i) {
        const double x = low.x() + cell * (i + 0.5) / 2;
        while (next < line.size() && line[next].x < x) winding += line[next++].in;
        if (winding > 0) ++inside[c.index(i / 2, j / 2, k / 2)];
      }
    }
  }
  for (std::size_t i = 0; i < inside.size(); ++i) c.label[i] = inside[i] >= 4 ? 1 : 0;
  return fill(c, [&](int i, int j, int k) -> Vector3d { return low + cell * Vector3d(i, j, k); });
}

}  // namespace vest::volume

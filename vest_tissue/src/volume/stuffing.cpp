#include "vest_tissue/volume/stuffing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <unordered_map>

#include "label_field.h"

namespace vest::volume {
namespace {

using Eigen::Vector3d;
using Tet = std::array<Index, 4>;

/// How near a cut may come to a lattice node before the node moves onto it, as part of its edge: long edges
/// (of length `cell`) and short ones (Labelle and Shewchuk 2007, table 2: 10.7 … 164.8 degrees).
constexpr double kNearLong = 0.24999, kNearShort = 0.41189;

/// Cosines of 12 and 165 degrees: angles that moved nodes must leave (tuned).
constexpr double kSharpest = 0.97814760073380558, kFlattest = -0.96592582628906829;

/// Body-centred cubic lattice over a box: corners of cubes, then their centres.
struct CubeGrid {
  Vector3d base;
  double cell;
  std::array<long, 3> size;

  Index corner(long i, long j, long k) const {
    return static_cast<Index>((k * (size[1] + 1) + j) * (size[0] + 1) + i);
  }
  Index corners() const { return corner(0, 0, size[2] + 1); }
  Index centre(long i, long j, long k) const {
    return corners() + static_cast<Index>((k * size[1] + j) * size[0] + i);
  }
  std::vector<Vector3d> places() const {
    std::vector<Vector3d> all;
    for (int kind = 0; kind < 2; ++kind)
      for (long k = 0; k < size[2] + 1 - kind; ++k)
        for (long j = 0; j < size[1] + 1 - kind; ++j)
          for (long i = 0; i < size[0] + 1 - kind; ++i)
            all.push_back(base + cell * (Vector3d(i, j, k) + Vector3d::Constant(0.5 * kind)));
    return all;
  }
  /// Four tetrahedra around the line between each two neighbouring centres; the edges 0–1 and 2–3 are long.
  std::vector<Tet> tetrahedra() const {
    std::vector<Tet> all;
    for (long k = 0; k < size[2]; ++k)
      for (long j = 0; j < size[1]; ++j)
        for (long i = 0; i < size[0]; ++i)
          for (int axis = 0; axis < 3; ++axis) {
            long next[3] = {i, j, k};
            if (++next[axis] == size[axis]) continue;
            const int u = (axis + 1) % 3, v = (axis + 2) % 3;
            Index ring[4];
            for (int q = 0; q < 4; ++q) {
              long at[3] = {next[0], next[1], next[2]};
              at[u] += q == 1 || q == 2, at[v] += q >= 2;
              ring[q] = corner(at[0], at[1], at[2]);
            }
            for (int q = 0; q < 4; ++q)
              all.push_back({centre(i, j, k), centre(next[0], next[1], next[2]), ring[q], ring[(q + 1) % 4]});
          }
    return all;
  }
};

CubeGrid cubesAround(const LabelledImage& image, double cell) {
  std::array<std::uint32_t, 3> low = image.size, high{};
  for (std::uint32_t k = 0; k < image.size[2]; ++k)
    for (std::uint32_t j = 0; j < image.size[1]; ++j)
      for (std::uint32_t i = 0; i < image.size[0]; ++i) {
        if (image.at(i, j, k) == 0) continue;
        const std::uint32_t at[3] = {i, j, k};
        for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], at[a]), high[a] = std::max(high[a], at[a]);
      }
  if (low[0] > high[0]) throw std::invalid_argument("labels: nothing is labelled");
  CubeGrid cubes{Vector3d::Zero(), cell, {}};
  double count = 1;
  for (int a = 0; a < 3; ++a) {
    const double first = (low[a] - 0.5) * image.spacing[a],
                 extent = (high[a] - low[a] + 1) * image.spacing[a];
    const double n =
        std::ceil(extent / cell) + 3;  // all that is on the edge of the box is outside of the body
    count *= n;
    if (!(count <= static_cast<double>(kMostCubes)))
      throw std::invalid_argument("cell " + std::to_string(cell) + " m: more than " +
                                  std::to_string(kMostCubes) + " cubes; a larger cell is needed");
    cubes.size[a] = static_cast<long>(n);
    cubes.base[a] = first + 0.5 * extent - 0.5 * n * cell;
  }
  return cubes;
}

/// Where f changes its sign between two places, as part of the way: f(from) and f(to) differ in sign.
template <class Function>
double crossing(const Vector3d& from, const Vector3d& to, double at_from, const Function& f) {
  double low = 0, high = 1;
  for (int i = 0; i < 12; ++i) {
    const double middle = 0.5 * (low + high);
    ((f(from + middle * (to - from)) > 0) == (at_from > 0) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

struct Cut {
  Index node[2];
  double part;  // of the way from node[0] to node[1]
  bool is_long, alive = true;
};

std::uint64_t edgeKey(Index a, Index b) {
  return (std::uint64_t{std::min(a, b)} << 32) | std::max(a, b);
}

/// The stuffing itself: places and signs of lattice nodes, cuts of edges, and what they leave of the
/// tetrahedra.
class Stuffing {
 public:
  Stuffing(const LabelField& field, const CubeGrid& cubes)
      : field_(field), places_(cubes.places()), tetrahedra_(cubes.tetrahedra()), value_(places_.size()) {
    for (std::size_t n = 0; n < places_.size(); ++n) value_[n] = inside(places_[n]);
    cutEdges();
    warp();
    nodes_ = places_;
    for (const Cut& cut : cuts_) {  // behind the lattice's nodes, dead ones too: they are left out at the end
      const Vector3d &from = places_[cut.node[0]], &to = places_[cut.node[1]];
      nodes_.push_back(from + cut.part * (to - from));
    }
    for (const Tet& t : tetrahedra_) fill(t);
  }

  Lattice lattice() const {
    Lattice lattice;
    std::vector<Index> number(nodes_.size(), std::numeric_limits<Index>::max());
    for (Tet t : filled_) {
      for (Index& n : t) {
        if (number[n] == std::numeric_limits<Index>::max()) {
          number[n] = static_cast<Index>(lattice.nodes.size());
          lattice.nodes.push_back(nodes_[n]);
        }
        n = number[n];
      }
      lattice.tetrahedra.push_back(t);
    }
    return lattice;
  }

 private:
  double inside(const Vector3d& place) const { return field_.at(place).any() - 0.5; }

  void cutEdges() {
    const auto f = [this](const Vector3d& place) { return inside(place); };
    for (const Tet& t : tetrahedra_)
      for (int a = 0; a < 4; ++a)
        for (int b = a + 1; b < 4; ++b) {
          const Index from = std::min(t[a], t[b]), to = std::max(t[a], t[b]);
          if ((value_[from] > 0) == (value_[to] > 0) || value_[from] == 0 || value_[to] == 0) continue;
          if (!cut_of_.emplace(edgeKey(from, to), cuts_.size()).second) continue;
          const bool is_long = (a == 0 && b == 1) || (a == 2 && b == 3);
          cuts_.push_back({{from, to}, crossing(places_[from], places_[to], value_[from], f), is_long});
        }
  }

  void warp() {
    std::vector<std::vector<std::size_t>> at(places_.size());
    for (std::size_t c = 0; c < cuts_.size(); ++c)
      for (const Index n : cuts_[c].node) at[n].push_back(c);
    std::vector<Vector3d> moved = places_;
    for (Index n = 0; n < places_.size(); ++n) {
      double nearest = 1;
      for (const std::size_t c : at[n]) {
        const Cut& cut = cuts_[c];
        if (!cut.alive) continue;
        const double part = cut.node[0] == n ? cut.part : 1 - cut.part;
        const double of_allowed = part / (cut.is_long ? kNearLong : kNearShort);
        if (of_allowed >= nearest) continue;
        nearest = of_allowed;
        moved[n] = places_[cut.node[0]] + cut.part * (places_[cut.node[1]] - places_[cut.node[0]]);
      }
      if (nearest >= 1) continue;
      value_[n] = 0;
      for (const std::size_t c : at[n]) cuts_[c].alive = false;
    }
    places_ = moved;
  }

  Index cut(Index a, Index b) const { return static_cast<Index>(places_.size() + cut_of_.at(edgeKey(a, b))); }

  /// Which of a four-sided face's corners its diagonal starts from: the first in an order of all nodes, so
  /// that both neighbours split it alike, and no three diagonals of a prism go round.
  std::pair<int, Index> order(Index node) const {
    if (node < places_.size()) return {1, node};
    return {cuts_[node - places_.size()].is_long ? 0 : 2, node};
  }
  bool before(Index a, Index b) const { return order(a) < order(b); }

  void add(Tet t) {
    const Vector3d& o = nodes_[t[0]];
    if ((nodes_[t[1]] - o).cross(nodes_[t[2]] - o).dot(nodes_[t[3]] - o) < 0) std::swap(t[2], t[3]);
    filled_.push_back(t);
  }

  void addPyramid(Index apex, std::array<Index, 4> q) {
    const auto first =
        std::min_element(q.begin(), q.end(), [this](Index a, Index b) { return before(a, b); });
    std::rotate(q.begin(), first, q.end());
    add({apex, q[0], q[1], q[2]});
    add({apex, q[0], q[2], q[3]});
  }

  /// A prism, corner a[i] joined to b[i] (Dompierre et al. 1999, How to subdivide pyramids, prisms and
  /// hexahedra into tetrahedra).
  void addPrism(std::array<Index, 3> a, std::array<Index, 3> b) {
    const auto less = [this](Index x, Index y) { return before(x, y); };
    auto first = std::min_element(a.begin(), a.end(), less);
    const auto other = std::min_element(b.begin(), b.end(), less);
    if (before(*other, *first)) {
      const auto at = other - b.begin();
      std::swap(a, b);
      first = a.begin() + at;
    }
    const auto turn = first - a.begin();
    std::rotate(a.begin(), a.begin() + turn, a.end());
    std::rotate(b.begin(), b.begin() + turn, b.end());
    add({a[0], b[0], b[1], b[2]});
    addPyramid(a[0], {a[1], a[2], b[2], b[1]});
  }

  void fill(const Tet& t) {
    std::vector<Index> in, on, out;
    for (const Index n : t) (value_[n] > 0 ? in : value_[n] < 0 ? out : on).push_back(n);
    if (in.empty()) return;
    if (out.empty()) return add(t);
    if (in.size() == 1) {
      Tet piece{in[0]};
      std::size_t i = 1;
      for (const Index n : on) piece[i++] = n;
      for (const Index n : out) piece[i++] = cut(in[0], n);
      return add(piece);
    }
    if (in.size() == 3)
      return addPrism({in[0], in[1], in[2]}, {cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0])});
    if (on.size() == 1) return addPyramid(on[0], {in[0], in[1], cut(in[1], out[0]), cut(in[0], out[0])});
    addPrism({in[0], cut(in[0], out[0]), cut(in[0], out[1])},
             {in[1], cut(in[1], out[0]), cut(in[1], out[1])});
  }

  const LabelField& field_;
  std::vector<Vector3d> places_;
  std::vector<Tet> tetrahedra_;
  std::vector<double> value_;
  std::vector<Cut> cuts_;
  std::unordered_map<std::uint64_t, std::size_t> cut_of_;
  std::vector<Vector3d> nodes_;
  std::vector<Tet> filled_;
};

/// Cosines of the greatest and the least dihedral angle; (-1, 1) of a tetrahedron that is flat or turned
/// inside out. Cosines, for acos() has other last bits on other machines.
std::pair<double, double> cosinesOf(const std::vector<Vector3d>& nodes, const Tet& t) {
  const Vector3d &a = nodes[t[0]], &b = nodes[t[1]], &c = nodes[t[2]], &d = nodes[t[3]];
  if (!((b - a).cross(c - a).dot(d - a) > 0)) return {-1, 1};
  // Outward normals of the faces opposite to each corner.
  const Vector3d normal[4] = {(c - b).cross(d - b).normalized(), (d - a).cross(c - a).normalized(),
                              (b - a).cross(d - a).normalized(), (c - a).cross(b - a).normalized()};
  std::pair<double, double> all{1, -1};
  for (int i = 0; i < 4; ++i)
    for (int j = i + 1; j < 4; ++j) {
      const double cosine = -normal[i].dot(normal[j]);
      all.first = std::min(all.first, cosine), all.second = std::max(all.second, cosine);
    }
  return all;
}

/// Labels of tetrahedra, and nodes between two labels onto their interface.
class Interfaces {
 public:
  Interfaces(const LabelField& field, Lattice& lattice)
      : field_(field), lattice_(lattice), around_(lattice.nodes.size()) {
    for (std::size_t t = 0; t < lattice.tetrahedra.size(); ++t)
      for (const Index n : lattice.tetrahedra[t]) around_[n].push_back(t);
    findFaces();
    lattice_.label.resize(lattice.tetrahedra.size());
    for (int round = 0; round < 3; ++round) {
      for (std::size_t t = 0; t < lattice_.tetrahedra.size(); ++t)
        lattice_.label[t] = labelOf(lattice_.tetrahedra[t]);
      for (Index n = 0; n < lattice_.nodes.size(); ++n)
        if (!surface_[n]) move(n);
    }
    centreFaces();
  }

 private:
  struct Face {
    std::array<Index, 3> nodes;
    std::size_t of[2];  // tetrahedra
  };

  void findFaces() {
    std::vector<std::pair<std::array<Index, 3>, std::size_t>> all;
    for (std::size_t e = 0; e < lattice_.tetrahedra.size(); ++e)
      for (int i = 0; i < 4; ++i) {
        const Tet& t = lattice_.tetrahedra[e];
        std::array<Index, 3> face{t[(i + 1) % 4], t[(i + 2) % 4], t[(i + 3) % 4]};
        std::sort(face.begin(), face.end());
        all.emplace_back(face, e);
      }
    std::sort(all.begin(), all.end());
    surface_.assign(lattice_.nodes.size(), false);
    for (std::size_t f = 0; f < all.size(); ++f) {
      if (f + 1 < all.size() && all[f].first == all[f + 1].first) {
        faces_.push_back({all[f].first, {all[f].second, all[f + 1].second}});
        ++f;
      } else {
        for (const Index n : all[f].first) surface_[n] = true;
      }
    }
  }

  /// Faces whose corners lie on a curved interface cut through its inside. Half of what their middles lack,
  /// at the corners, leaves as much on either side.
  void centreFaces() {
    std::vector<Vector3d> lack(lattice_.nodes.size(), Vector3d::Zero());
    std::vector<int> count(lattice_.nodes.size(), 0);
    for (const Face& face : faces_) {
      const std::uint16_t a = lattice_.label[face.of[0]], b = lattice_.label[face.of[1]];
      if (a == b) continue;
      const Vector3d &p = lattice_.nodes[face.nodes[0]], &q = lattice_.nodes[face.nodes[1]],
                     &r = lattice_.nodes[face.nodes[2]];
      const Vector3d middle = (p + q + r) / 3, across = (q - p).cross(r - p);
      const auto f = [&](const Vector3d& place) { return difference(place, a, b); };
      const double here = f(middle);
      for (const double side : {1.0, -1.0}) {
        const Vector3d way = 0.25 * side * std::sqrt(across.norm()) * across.normalized();
        if ((f(middle + way) > 0) == (here > 0)) continue;
        for (const Index n : face.nodes) lack[n] += crossing(middle, Vector3d(middle + way), here, f) * way;
        break;
      }
      for (const Index n : face.nodes) ++count[n];
    }
    for (Index n = 0; n < lack.size(); ++n) {
      if (count[n] == 0 || surface_[n]) continue;
      const Vector3d from = lattice_.nodes[n];
      lattice_.nodes[n] += 0.5 * lack[n] / count[n];
      if (!keepsAngles(n)) lattice_.nodes[n] = from;
    }
  }

  double difference(const Vector3d& place, std::uint16_t a, std::uint16_t b) const {
    const auto shares = field_.at(place);
    return shares.of(a) - shares.of(b);
  }

  std::uint16_t labelOf(const Tet& t) const {
    const Vector3d centre =
        0.25 * (lattice_.nodes[t[0]] + lattice_.nodes[t[1]] + lattice_.nodes[t[2]] + lattice_.nodes[t[3]]);
    LabelField::Shares sum = field_.at(centre);
    for (const Index n : t) {
      const auto some = field_.at(0.5 * (centre + lattice_.nodes[n]));
      for (int i = 0; i < some.count; ++i) sum.add(some.label[i], some.share[i]);
    }
    return sum.most();
  }

  bool keepsAngles(Index n) const {
    for (const std::size_t t : around_[n]) {
      const auto [flattest, sharpest] = cosinesOf(lattice_.nodes, lattice_.tetrahedra[t]);
      if (flattest < kFlattest || sharpest > kSharpest) return false;
    }
    return true;
  }

  /// To the nearest place on an edge where the two labels around the node see as much of each other.
  void move(Index n) {
    std::uint16_t a = lattice_.label[around_[n][0]], b = a;
    for (const std::size_t t : around_[n]) {
      const std::uint16_t label = lattice_.label[t];
      if (label == a || label == b) continue;
      if (a != b) return;  // where three meet, nothing moves
      b = label;
    }
    if (a == b) return;
    const auto f = [&](const Vector3d& place) { return difference(place, a, b); };
    const Vector3d from = lattice_.nodes[n];
    const double here = f(from);
    std::vector<std::pair<double, Vector3d>> roots;
    for (const std::size_t t : around_[n])
      for (const Index to : lattice_.tetrahedra[t]) {
        if (to == n || (f(lattice_.nodes[to]) > 0) == (here > 0)) continue;
        const Vector3d way = crossing(from, lattice_.nodes[to], here, f) * (lattice_.nodes[to] - from);
        roots.emplace_back(way.squaredNorm(), way);
      }
    std::sort(roots.begin(), roots.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    for (const double part : {1.0, 0.75, 0.5, 0.25})
      for (const auto& [square, way] : roots) {
        lattice_.nodes[n] = from + part * way;
        if (keepsAngles(n)) return;
      }
    lattice_.nodes[n] = from;
  }

  const LabelField& field_;
  Lattice& lattice_;
  std::vector<std::vector<std::size_t>> around_;
  std::vector<bool> surface_;
  std::vector<Face> faces_;  // between two tetrahedra
};

}  // namespace

Lattice stuffLabels(const LabelledImage& image, double cell) {
  if (!(cell > 0 && cell <= 1)) throw std::invalid_argument("cell: more than 0, at most 1 m");
  const LabelField field(image);
  Lattice lattice = Stuffing(field, cubesAround(image, cell)).lattice();
  if (lattice.tetrahedra.empty())
    throw std::invalid_argument("labels: everything is thinner than a voxel or a cell");
  Interfaces(field, lattice);
  for (Vector3d& node : lattice.nodes) node = image.origin + image.direction * node;
  if (image.direction.determinant() < 0)
    for (Tet& t : lattice.tetrahedra) std::swap(t[2], t[3]);
  return lattice;
}

std::pair<double, double> dihedralAngles(const Lattice& lattice) {
  std::pair<double, double> all{1, -1};
  for (const Tet& t : lattice.tetrahedra) {
    const auto [flattest, sharpest] = cosinesOf(lattice.nodes, t);
    all.first = std::min(all.first, flattest), all.second = std::max(all.second, sharpest);
  }
  const auto degrees = [](double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / M_PI; };
  return {degrees(all.second), degrees(all.first)};
}

double volumeOf(const Lattice& lattice, std::uint16_t label) {
  double sum = 0;
  for (std::size_t t = 0; t < lattice.tetrahedra.size(); ++t) {
    if (lattice.label[t] != label) continue;
    const auto& n = lattice.tetrahedra[t];
    const Vector3d& o = lattice.nodes[n[0]];
    sum += (lattice.nodes[n[1]] - o).cross(lattice.nodes[n[2]] - o).dot(lattice.nodes[n[3]] - o) / 6;
  }
  return sum;
}

}  // namespace vest::volume

#include "vest_tissue/suture/knot_kind.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace vest::suture {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kClosing = 3;  ///< nodes far away that close a thread
constexpr double kFar = 10.0;        ///< times the thread's size
constexpr std::size_t kPiece = 4;    ///< nodes that are taken from an end at once
constexpr double kZero = 1e-6;       ///< no unit: entries are whole numbers, pivots are fractions of them

double cross(const Vector3d& a, const Vector3d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

Vector3d unit(const Vector3d& v, const Vector3d& otherwise) {
  const double size = std::sqrt(v.squaredNorm());
  return size > 0.0 ? Vector3d(v / size) : otherwise;
}

/// Determinant and signature of a symmetric matrix of whole numbers, which is used up.
struct FormInertia {
  double determinant = 1.0;
  int signature = 0;
};
FormInertia inertiaOf(std::vector<double>& m, int n, int stride) {
  FormInertia out;
  const auto at = [&](int r, int c) -> double& { return m[static_cast<std::size_t>(r * stride + c)]; };
  const auto swap = [&](int a, int b) {
    for (int k = 0; k < n; ++k) std::swap(at(a, k), at(b, k));
    for (int k = 0; k < n; ++k) std::swap(at(k, a), at(k, b));
  };
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k; i < n; ++i)
      if (std::abs(at(i, i)) > std::abs(at(pivot, pivot))) pivot = i;
    if (std::abs(at(pivot, pivot)) > kZero) {
      swap(k, pivot);
      const double d = at(k, k);
      out.determinant *= d, out.signature += d > 0.0 ? 1 : -1;
      for (int i = k + 1; i < n; ++i)
        for (int j = k + 1; j < n; ++j) at(i, j) -= at(i, k) * at(k, j) / d;
      continue;
    }
    int r = -1, c = -1;  // a diagonal of zeros: two at once, one of each sign
    for (int i = k; i < n; ++i)
      for (int j = i + 1; j < n; ++j)
        if (std::abs(at(i, j)) > (r < 0 ? kZero : std::abs(at(r, c)))) r = i, c = j;
    if (r < 0) return {0.0, 0};
    swap(k, r), swap(k + 1, c);
    const double a = at(k, k), b = at(k, k + 1), d = at(k + 1, k + 1), whole = a * d - b * b;
    out.determinant *= whole;
    for (int i = k + 2; i < n; ++i)
      for (int j = k + 2; j < n; ++j)
        at(i, j) -= (at(i, k) * (d * at(k, j) - b * at(k + 1, j)) +
                     at(i, k + 1) * (a * at(k + 1, j) - b * at(k, j))) /
                    whole;
    ++k;
  }
  return out;
}

}  // namespace

KnotScratch::KnotScratch(std::size_t nodes) {
  constexpr auto most = static_cast<std::size_t>(kMostCrossings);
  drawn_.reserve(nodes + kClosing);
  crossings_.reserve(most), passes_.reserve(2 * most);
  at_.resize(4 * most), face_.resize(4 * most);
  colour_.resize(most + 2), matrix_.resize((most + 2) * (most + 2));
}

bool KnotScratch::findCrossings() {
  crossings_.clear(), passes_.clear();
  const std::size_t n = drawn_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d a = drawn_[(i + 1) % n] - drawn_[i];
    for (std::size_t j = i + 2; j < n - (i == 0 ? 1 : 0); ++j) {
      const Vector3d b = drawn_[(j + 1) % n] - drawn_[j], r = drawn_[j] - drawn_[i];
      const double whole = cross(a, b);
      if (whole == 0.0) continue;
      const double s = cross(r, b) / whole, t = cross(r, a) / whole;
      if (!(s >= 0.0 && s < 1.0 && t >= 0.0 && t < 1.0)) continue;
      if (crossings_.size() == static_cast<std::size_t>(kMostCrossings)) return false;
      const int number = static_cast<int>(crossings_.size());
      Crossing c;
      c.left = whole > 0.0;
      c.first_over = s * a.z() > r.z() + t * b.z();
      crossings_.push_back(c);
      passes_.push_back({static_cast<double>(i) + s, number, 0});
      passes_.push_back({static_cast<double>(j) + t, number, 1});
    }
  }
  std::sort(passes_.begin(), passes_.end(), [](const Pass& p, const Pass& q) { return p.at < q.at; });
  return true;
}

/// Half-edge 2e leads from pass e to the next one, 2e + 1 back again; each has its face on its left.
int KnotScratch::findFaces() {
  const int edges = static_cast<int>(passes_.size());
  for (int k = 0; k < edges; ++k) {
    const Pass& p = passes_[static_cast<std::size_t>(k)];
    crossings_[static_cast<std::size_t>(p.crossing)].pass[p.strand] = k;
  }
  for (std::size_t c = 0; c < crossings_.size(); ++c) {
    Crossing& x = crossings_[c];
    const auto out = [](int pass) { return 2 * pass; };
    const auto in = [edges](int pass) { return 2 * ((pass + edges - 1) % edges) + 1; };
    const int a = x.pass[0], b = x.pass[1];
    x.ray[0] = out(a), x.ray[2] = in(a);
    x.ray[1] = x.left ? out(b) : in(b), x.ray[3] = x.left ? in(b) : out(b);
    for (int k = 0; k < 4; ++k) at_[static_cast<std::size_t>(x.ray[k])] = 4 * static_cast<int>(c) + k;
  }
  std::fill(face_.begin(), face_.begin() + 2 * edges, -1);
  int faces = 0;
  for (int h = 0; h < 2 * edges; ++h) {
    if (face_[static_cast<std::size_t>(h)] >= 0) continue;
    for (int g = h; face_[static_cast<std::size_t>(g)] < 0;) {
      face_[static_cast<std::size_t>(g)] = faces;
      const int there = at_[static_cast<std::size_t>(g ^ 1)];
      g = crossings_[static_cast<std::size_t>(there / 4)].ray[(there % 4 + 3) % 4];
    }
    ++faces;
  }
  return faces;
}

/// As a chessboard. False: it is none.
bool KnotScratch::colourFaces(int faces) {
  std::fill(colour_.begin(), colour_.begin() + faces, -1);
  colour_[0] = 0;
  const auto edges = passes_.size();
  for (bool more = true; more;) {
    more = false;
    for (std::size_t e = 0; e < edges; ++e) {
      int &p = colour_[static_cast<std::size_t>(face_[2 * e])],
          &q = colour_[static_cast<std::size_t>(face_[2 * e + 1])];
      if (p >= 0 && p == q) return false;
      if ((p < 0) == (q < 0)) continue;
      (p < 0 ? p : q) = 1 - (p < 0 ? q : p);
      more = true;
    }
  }
  return true;
}

KnotKind KnotScratch::measure(int faces) {
  int white = 0;
  for (int f = 0; f < faces; ++f) {
    int& colour = colour_[static_cast<std::size_t>(f)];
    colour = colour == 0 ? white++ : -1;
  }
  std::fill(matrix_.begin(), matrix_.begin() + white * white, 0.0);
  int correction = 0;
  for (const Crossing& x : crossings_) {
    const auto number = [&](int k) {
      return colour_[static_cast<std::size_t>(face_[static_cast<std::size_t>(x.ray[k])])];
    };
    const int k = number(0) >= 0 ? 0 : 1, p = number(k), q = number(k + 2);
    const double turn = (k == 0) == x.first_over ? 1.0 : -1.0;
    if ((k == 0) != x.left) correction += static_cast<int>(turn);
    if (p == q) continue;
    const auto at = [&](int r, int c) -> double& { return matrix_[static_cast<std::size_t>(r * white + c)]; };
    at(p, q) -= turn, at(q, p) -= turn, at(p, p) += turn, at(q, q) += turn;
  }
  const FormInertia found = inertiaOf(matrix_, white - 1, white);  // without the last face
  KnotKind kind;
  const double size = std::abs(found.determinant);
  if (!(size < 1e6)) return {0, 0};
  kind.determinant = static_cast<std::int32_t>(std::lround(size));
  kind.signature = correction - found.signature;  // a right-handed throw has -2
  return kind;
}

KnotKind kindOf(const Vector3d* nodes, std::size_t count, KnotScratch& w) {
  if (count < 3 || count + kClosing > w.drawn_.capacity()) return {};
  Vector3d middle = Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) middle += nodes[i];
  middle /= static_cast<double>(count);
  double size = 0.0;
  for (std::size_t i = 0; i < count; ++i) size = std::max(size, (nodes[i] - middle).squaredNorm());
  size = kFar * std::sqrt(size);
  const Vector3d last = unit(nodes[count - 1] - middle, Vector3d::UnitX()),
                 first = unit(nodes[0] - middle, -Vector3d::UnitX());
  Vector3d beside = last.cross(first);
  if (!(beside.squaredNorm() > 1e-6)) beside = last.unitOrthogonal();
  // Any direction does from which no two segments lie in one line.
  const Vector3d eye = Vector3d(0.2817, 0.5391, 0.7937).normalized(),
                 u = eye.cross(Vector3d(0.7331, -0.6129, 0.2947)).normalized(), v = eye.cross(u);
  const auto draw = [&](const Vector3d& x) { w.drawn_.emplace_back(x.dot(u), x.dot(v), x.dot(eye)); };
  w.drawn_.clear();
  for (std::size_t i = 0; i < count; ++i) draw(nodes[i] - middle);
  draw(size * last), draw(size * unit(beside, Vector3d::UnitZ())), draw(size * first);
  if (!w.findCrossings()) return {0, 0};
  if (w.crossings_.empty()) return {};
  const int faces = w.findFaces();
  if (faces != static_cast<int>(w.crossings_.size()) + 2 || !w.colourFaces(faces)) return {0, 0};
  return w.measure(faces);
}

KnotPlace placeOfKnot(const Vector3d* nodes, std::size_t count, KnotScratch& w) {
  const std::size_t end = count == 0 ? 0 : count - 1;
  KnotPlace out{kindOf(nodes, count, w), 0, end};
  if (out.kind.determinant == 1 || out.kind.determinant == 0) return out;
  const auto has = [&](std::size_t first, std::size_t last) {
    return kindOf(nodes + first, last - first + 1, w) == out.kind;
  };
  // From within: a tail that curls may lie across its knot where pieces are taken from it, and each of them
  // would end the search from without.
  std::size_t lost = end;
  for (std::size_t at = end - end % kPiece; at > 0 && out.first == 0; at -= kPiece)
    (has(at, end) ? out.first : lost) = at;
  for (; lost > out.first + 1;) {
    const std::size_t middle = (out.first + lost) / 2;
    (has(middle, end) ? out.first : lost) = middle;
  }
  lost = 0;
  for (std::size_t at = kPiece; at < end && out.last == end; at += kPiece)
    (has(0, at) ? out.last : lost) = at;
  for (; out.last > lost + 1;) {
    const std::size_t middle = (out.last + lost) / 2;
    (has(0, middle) ? out.last : lost) = middle;
  }
  return out;
}

}  // namespace vest::suture

#include "vest_viz/effects/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/gtc/noise.hpp>
#include <glm/vec2.hpp>

namespace vest::effects {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using instrument::TriangleMesh;

constexpr double kPi = 3.14159265358979323846;
/// mm: ground that rises higher over a pool is dry, whatever its relief (ogre_media/pool.frag).
constexpr float kDryGround = -0.75f;

void addVertex(TriangleMesh* m, const Vector3d& p, const Vector3d& n) {
  for (int k = 0; k < 3; ++k) {
    m->positions.push_back(static_cast<float>(p[k]));
    m->normals.push_back(static_cast<float>(n[k]));
  }
}

/// Sweeps a circle along points; radii per point. Open ends get a cap through a vertex of radius 0.
TriangleMesh sweep(const std::vector<Vector3d>& points, const std::vector<double>& radii, bool closed,
                   int sides) {
  TriangleMesh m;
  const std::size_t n = points.size();
  if (n < 2) return m;
  // Frames by parallel transport, so that the tube does not twist.
  Vector3d normal = Vector3d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3d& before = points[closed ? (i + n - 1) % n : i > 0 ? i - 1 : 0];
    const Vector3d& after = points[closed ? (i + 1) % n : std::min(i + 1, n - 1)];
    Vector3d t = after - before;
    if (t.norm() < 1e-12) t = Vector3d::UnitZ();
    t.normalize();
    normal -= normal.dot(t) * t;
    if (normal.norm() < 1e-6)
      normal = std::fabs(t.x()) < 0.8 ? t.cross(Vector3d::UnitX()) : t.cross(Vector3d::UnitY());
    normal.normalize();
    const Vector3d side = t.cross(normal);
    for (int k = 0; k < sides; ++k) {
      const double a = 2 * kPi * k / sides;
      const Vector3d d = std::cos(a) * normal + std::sin(a) * side;
      addVertex(&m, points[i] + radii[i] * d, d);
    }
  }
  const auto at = [&](std::size_t ring, int k) {
    return static_cast<std::uint32_t>((ring % n) * static_cast<std::size_t>(sides) +
                                      static_cast<std::size_t>(k % sides));
  };
  for (std::size_t i = 0; i + (closed ? 0 : 1) < n; ++i)
    for (int k = 0; k < sides; ++k)
      m.triangles.insert(m.triangles.end(), {at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k),
                                             at(i + 1, k + 1), at(i, k + 1)});
  if (closed) return m;
  for (std::size_t end : {std::size_t{0}, n - 1}) {
    const auto tip = static_cast<std::uint32_t>(m.positions.size() / 3);
    const Vector3d out = (end == 0 ? points[0] - points[1] : points[n - 1] - points[n - 2]).normalized();
    addVertex(&m, points[end] + 0.5 * radii[end] * out, out);
    for (int k = 0; k < sides; ++k)
      if (end == 0)
        m.triangles.insert(m.triangles.end(), {tip, at(0, k), at(0, k + 1)});
      else
        m.triangles.insert(m.triangles.end(), {tip, at(end, k + 1), at(end, k)});
  }
  return m;
}

/// Corners of a quad in the plane across the line of sight: along `u`, and across it.
void addQuad(const Vector3f& centre, const Vector3f& along, const Vector3f& across, float opacity, float kind,
             float phase, Quads* q) {
  for (int k = 0; k < 4; ++k) {
    const float a = k == 1 || k == 2 ? 1.0f : -1.0f, b = k >= 2 ? 1.0f : -1.0f;
    const Vector3f p = centre + a * along + b * across;
    q->corners.insert(q->corners.end(), {p.x(), p.y(), p.z()});
    q->colours.insert(q->colours.end(), {1.0f, 1.0f, 1.0f});
    q->features.insert(q->features.end(), {opacity, kind, phase});
  }
}

/// None where one is not finite.
std::vector<Vector3d> placesOf(const float* points, std::size_t count) {
  std::vector<Vector3d> p;
  for (std::size_t i = 0; i < count; ++i) {
    p.emplace_back(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
    if (!p.back().allFinite()) return {};
  }
  return p;
}

/// Two directions across the line of sight.
void facing(const Vector3f& sight, Vector3f* u, Vector3f* v) {
  *u = std::fabs(sight.z()) < 0.9f ? sight.cross(Vector3f::UnitZ()) : sight.cross(Vector3f::UnitX());
  u->normalize();
  *v = sight.cross(*u);
}

}  // namespace

TriangleMesh tube(const float* points, std::size_t count, double radius, bool closed) {
  const std::vector<Vector3d> p = placesOf(points, count);
  if (!(radius > 0)) return {};
  return sweep(p, std::vector<double>(p.size(), radius), closed && p.size() > 2, 8);
}

TriangleMesh clip(double length, double gap, double wire) {
  std::vector<Vector3d> p;
  const double x = 0.5 * gap + wire;
  for (int i = 0; i <= 6; ++i) p.emplace_back(x, 0, 0.5 * length - length * i / 6.0);
  for (int i = 1; i < 8; ++i) {
    const double a = kPi * i / 8;
    p.emplace_back(x * std::cos(a), 0, -0.5 * length - x * std::sin(a));
  }
  for (int i = 0; i <= 6; ++i) p.emplace_back(-x, 0, -0.5 * length + length * i / 6.0);
  TriangleMesh m = sweep(p, std::vector<double>(p.size(), wire), false, 8);
  // The legs are flat: wider across than thick.
  for (std::size_t i = 1; i < m.positions.size(); i += 3) m.positions[i] *= 1.6f;
  return m;
}

TriangleMesh needle(const float* points, std::size_t count, double wire_radius) {
  std::vector<Vector3d> p = placesOf(points, count);
  if (!(wire_radius > 0) || p.size() < 2) return {};
  std::vector<double> r;
  for (std::size_t i = 0; i < p.size(); ++i)
    r.push_back(wire_radius *
                std::min(1.0, 0.05 + 8.0 * static_cast<double>(i) / static_cast<double>(p.size() - 1)));
  return sweep(p, r, false, 8);
}

TriangleMesh ball(const Vector3d& centre, double radius) {
  TriangleMesh m;
  if (!centre.allFinite() || !(radius > 0)) return m;
  constexpr int kRows = 6, kColumns = 10;
  for (int i = 0; i <= kRows; ++i)
    for (int j = 0; j < kColumns; ++j) {
      const double a = kPi * i / kRows, b = 2 * kPi * j / kColumns;
      const Vector3d d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a));
      addVertex(&m, centre + radius * d, d);
      if (i == kRows) continue;
      const auto at = [](int row, int column) {
        return static_cast<std::uint32_t>(row * kColumns + column % kColumns);
      };
      m.triangles.insert(m.triangles.end(), {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j),
                                             at(i + 1, j + 1), at(i, j + 1)});
    }
  return m;
}

void append(TriangleMesh* a, const TriangleMesh& b, const Eigen::Isometry3d& X) {
  const auto first = static_cast<std::uint32_t>(a->positions.size() / 3);
  for (std::size_t i = 0; i + 2 < b.positions.size(); i += 3) {
    const Vector3d p(b.positions[i], b.positions[i + 1], b.positions[i + 2]);
    const Vector3d n(b.normals[i], b.normals[i + 1], b.normals[i + 2]);
    addVertex(a, X * p, X.linear() * n);
  }
  for (std::uint32_t v : b.triangles) a->triangles.push_back(first + v);
}

void addPuff(const Vector3d& centre, double radius, double density, double phase, std::uint32_t seed,
             const Vector3d& eye, Quads* q) {
  if (!centre.allFinite() || !(radius > 0 && radius < 1) || !(density >= 0) || !std::isfinite(phase)) return;
  const auto opacity = static_cast<float>(1.0 - std::exp(-kSmokeExtinction * density * 2 * radius));
  if (opacity < 0.004f) return;
  const Vector3f p = centre.cast<float>(), sight = (p - eye.cast<float>()).normalized();
  if (!sight.allFinite()) return;
  Vector3f u, w;
  facing(sight, &u, &w);
  const auto r = static_cast<float>(radius);
  addQuad(p, r * u, r * w, opacity, static_cast<float>(seed % 1024u) * 0.0061f, static_cast<float>(phase), q);
}

namespace {

/// A place of the surface: a cell's middle, or half-way between two.
struct PoolPlace {
  float height = 0, depth = 0, blood = 0, weight = 0;  ///< m, mm (< 0: dry), 0 … 1; 0: there is none
  float waves = 0;                                     ///< m/s

  void add(const PoolPlace& o, float share) {
    share *= o.weight > 0 ? 1.0f : 0.0f;
    height += share * o.height, depth += share * o.depth, blood += share * o.blood, weight += share;
    waves += share * o.waves;
  }
  void mean() {
    if (weight > 0) height /= weight, depth /= weight, blood /= weight, waves /= weight, weight = 1;
  }
};

/// Cells with a border: there the ground goes on rising as it does beside it, and the level stays, so that
/// the shore, where the depth is 0, runs between cells as the ground says.
std::vector<PoolPlace> withShore(int C, int R, const PoolCells& cells) {
  const auto wet = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < C && r < R && std::isfinite(cells.height[r * C + c]);
  };
  const auto depthOf = [&](int c, int r) {
    return cells.depth != nullptr ? 0.1f * cells.depth[r * C + c] : kUnknownDepth;
  };
  std::vector<PoolPlace> out(static_cast<std::size_t>((C + 2) * (R + 2)));
  for (int r = -1; r <= R; ++r)
    for (int c = -1; c <= C; ++c) {
      PoolPlace& to = out[static_cast<std::size_t>((r + 1) * (C + 2) + c + 1)];
      if (wet(c, r)) {
        to.height = cells.height[r * C + c], to.depth = depthOf(c, r), to.weight = 1;
        to.blood = cells.blood != nullptr ? cells.blood[r * C + c] / 255.0f
                                          : static_cast<float>(cells.blood_fraction);
        if (cells.velocity != nullptr && std::isfinite(cells.velocity[r * C + c]))
          to.waves = std::fabs(cells.velocity[r * C + c]);
        continue;
      }
      float beside = 0;
      bool corner = true;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          if (!wet(c + i, r + j)) continue;
          const float near = depthOf(c + i, r + j), weight = (i == 0 || j == 0) ? 2.0f : 1.0f;
          const bool further = wet(c + 2 * i, r + 2 * j);
          PoolPlace shore;
          shore.height = cells.height[(r + j) * C + c + i], shore.weight = 1;
          shore.depth = further ? 2 * near - depthOf(c + 2 * i, r + 2 * j) : near - 1;
          shore.blood = cells.blood != nullptr ? cells.blood[(r + j) * C + c + i] / 255.0f
                                               : static_cast<float>(cells.blood_fraction);
          to.add(shore, weight);
          beside += weight * near;
          corner = corner && i != 0 && j != 0;
        }
      // Off a corner alone the ground is farther: what stands in a few cells is round, not a box.
      const float away = corner ? 4.0f : 1.0f;
      if (to.weight > 0)
        to.depth = std::clamp(to.depth, -4 * to.weight,
                              -away * std::clamp(beside, 0.1f * to.weight, 0.4f * to.weight));
      to.mean();
    }
  return out;
}

/// Cells and what lies half-way between them: a cubic B-spline, halved once (Lane and Riesenfeld 1980). The
/// cells' corners do not show at the shore.
std::vector<PoolPlace> refined(const std::vector<PoolPlace>& coarse, int C, int R) {
  const int W = 2 * C - 1, H = 2 * R - 1;
  std::vector<PoolPlace> fine(static_cast<std::size_t>(W * H));
  constexpr float kEven[3] = {0.125f, 0.75f, 0.125f}, kOdd[2] = {0.5f, 0.5f};
  for (int y = 0; y < H; ++y)
    for (int x = 0; x < W; ++x) {
      PoolPlace& to = fine[static_cast<std::size_t>(y * W + x)];
      const int nx = x % 2 == 0 ? 3 : 2, ny = y % 2 == 0 ? 3 : 2;
      const int c0 = x / 2 - (nx == 3), r0 = y / 2 - (ny == 3);
      const float *wx = nx == 3 ? kEven : kOdd, *wy = ny == 3 ? kEven : kOdd;
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i)
          if (c0 + i >= 0 && c0 + i < C && r0 + j >= 0 && r0 + j < R)
            to.add(coarse[static_cast<std::size_t>((r0 + j) * C + c0 + i)], wx[i] * wy[j]);
      if (to.weight < 0.4f) to.weight = 0;  // beyond the border
      to.mean();
    }
  return fine;
}

/// A mesh over refined places (two border cells beyond the field). Features are blood and depth of each.
/// @param shown of a vertex's depth: triangles whose vertices have none of it are left out
template <class Shown>
Pool meshOf(const Eigen::Isometry3d& origin, double cell, int C, int R, const std::vector<PoolPlace>& fine,
            Shown&& shown) {
  Pool pool;
  const int W = 2 * C - 1, H = 2 * R - 1;
  const double half = 0.5 * cell;
  const auto value = [&](int x, int y, float otherwise) {
    if (x < 0 || y < 0 || x >= W || y >= H) return otherwise;
    const PoolPlace& p = fine[static_cast<std::size_t>(y * W + x)];
    return p.weight > 0 ? p.height : otherwise;
  };
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<std::uint32_t> index(fine.size(), kNone);
  for (int y = 0; y < H; ++y)
    for (int x = 0; x < W; ++x) {
      const PoolPlace& at = fine[static_cast<std::size_t>(y * W + x)];
      if (!(at.weight > 0)) continue;
      index[static_cast<std::size_t>(y * W + x)] = static_cast<std::uint32_t>(pool.positions.size() / 3);
      const float z = at.height;
      const Vector3d p = origin * Vector3d(half * x - half, half * y - half, z);
      const Vector3d n = origin.linear() * Vector3d((value(x - 1, y, z) - value(x + 1, y, z)) / cell,
                                                    (value(x, y - 1, z) - value(x, y + 1, z)) / cell, 1)
                                               .normalized();
      for (int k = 0; k < 3; ++k) {
        pool.positions.push_back(static_cast<float>(p[k]));
        pool.normals.push_back(static_cast<float>(n[k]));
      }
      pool.features.insert(pool.features.end(), {at.blood, at.depth, at.waves});
    }
  for (int y = 0; y + 1 < H; ++y)
    for (int x = 0; x + 1 < W; ++x) {
      const auto i = static_cast<std::size_t>(y * W + x), w = static_cast<std::size_t>(W);
      const std::uint32_t a = index[i], b = index[i + 1], d = index[i + w], e = index[i + w + 1];
      for (const std::array<std::uint32_t, 3>& t : {std::array<std::uint32_t, 3>{a, b, e}, {a, e, d}})
        if (std::find(t.begin(), t.end(), kNone) == t.end() &&
            std::any_of(t.begin(), t.end(), [&](auto v) { return shown(pool.features[3 * v + 1]); }))
          pool.triangles.insert(pool.triangles.end(), t.begin(), t.end());
    }
  return pool;
}

/// Two values of smooth noise, -1 … 1, in a table that repeats: reckoned at each place anew it cost as much
/// as the rest of a film.
class Lobes {
 public:
  Lobes() {
    std::size_t i = 0;
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x, ++i) {
        const glm::vec2 q = glm::vec2(x, y) / static_cast<float>(kPerLobe);
        for (int k = 0; k < 2; ++k) {
          const float from = k == 0 ? 17.3f : 41.9f;
          const float n = glm::perlin(q + from, glm::vec2(kLobes)) +
                          0.5f * glm::perlin(2.0f * q - from, glm::vec2(2 * kLobes));
          table_[i][k] = std::clamp(n, -1.0f, 1.0f);
        }
      }
  }
  /// @param x, y lobes; any number, for places come from messages
  glm::vec2 at(double x, double y) const {
    const auto within = [](double v) {
      const double in = kPerLobe * (v - kLobes * std::floor(v / kLobes));
      return static_cast<float>(in >= 0 && in <= kSide ? in : 0.0);
    };
    const glm::vec2 p(within(x), within(y)), low = glm::floor(p), part = p - low;
    const auto value = [&](int i, int j) {
      const int column = (static_cast<int>(low.x) + i) & (kSide - 1),
                row = (static_cast<int>(low.y) + j) & (kSide - 1);
      return table_[static_cast<std::size_t>(row * kSide + column)];
    };
    return glm::mix(glm::mix(value(0, 0), value(1, 0), part.x), glm::mix(value(0, 1), value(1, 1), part.x),
                    part.y);
  }

 private:
  static constexpr int kLobes = 16, kPerLobe = 8, kSide = kLobes * kPerLobe;
  std::array<glm::vec2, kSide * kSide> table_;
};

/// How far beside a refined place one looks, in places: noise that stands still in the world.
glm::vec2 lobe(const Eigen::Isometry3d& origin, double cell, int x, int y) {
  constexpr double kFrayed = 0.0030, kAcross = 0.0085;  // m: at most so far; from lobe to lobe (by eye)
  static const Lobes kNoise;
  const Vector3d p = origin * Vector3d(0.5 * cell * x, 0.5 * cell * y, 0) / kAcross;
  return kNoise.at(p.x(), p.y()) * static_cast<float>(kFrayed / (0.5 * cell));
}

/// Where a pool ends at a steep wall its cells do not tell where within them: there its shore is frayed, too,
/// or it would run in a straight row. On gentle ground the depths tell it (withShore()). Beyond the border
/// nothing is known: the depth goes on as it slopes.
void frayShore(const Eigen::Isometry3d& origin, double cell, int W, int H, std::vector<PoolPlace>& fine) {
  constexpr float kGentle = 2;  // mm of depth from cell to cell; twice as much is a wall (by eye)
  const std::vector<PoolPlace> even = fine;
  const auto there = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < W && y < H && even[static_cast<std::size_t>(y * W + x)].weight > 0;
  };
  const auto slope = [&](int x, int y, int i, int j) {
    const auto depth = [&](int u, int v) {
      return even[static_cast<std::size_t>(there(u, v) ? v * W + u : y * W + x)].depth;
    };
    return 0.5f * (depth(x + i, y + j) - depth(x - i, y - j));
  };
  for (int y = 0; y < H; ++y)
    for (int x = 0; x < W; ++x) {
      PoolPlace& to = fine[static_cast<std::size_t>(y * W + x)];
      if (!(to.weight > 0)) continue;
      const glm::vec2 down(slope(x, y, 1, 0), slope(x, y, 0, 1));
      const float wall = std::clamp((2 * glm::length(down) - kGentle) / kGentle, 0.0f, 1.0f);
      const float by = wall > 0 ? wall * glm::dot(lobe(origin, cell, x, y), down) : 0.0f;
      const bool ends = !there(x - 2, y) || !there(x + 2, y) || !there(x, y - 2) || !there(x, y + 2);
      to.depth += ends ? std::min(by, 0.0f) : by;  // where the mesh ends it gets no wetter, or its edge shows
    }
}

/// Blood on tissue has no border along the cells: each place shows what lies beside it, here nearer, there
/// farther.
void fray(const Eigen::Isometry3d& origin, double cell, int W, int H, std::vector<PoolPlace>& fine) {
  const std::vector<PoolPlace> even = fine;
  const auto value = [&](int x, int y) {
    return x < 0 || y < 0 || x >= W || y >= H ? 0.0f : even[static_cast<std::size_t>(y * W + x)].depth;
  };
  for (int y = 0; y < H; ++y)
    for (int x = 0; x < W; ++x) {
      PoolPlace& to = fine[static_cast<std::size_t>(y * W + x)];
      if (!(to.weight > 0)) continue;
      const glm::vec2 by = lobe(origin, cell, x, y);
      const float u = static_cast<float>(x) + by.x, v = static_cast<float>(y) + by.y;
      const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
      const float a = u - static_cast<float>(i), b = v - static_cast<float>(j);
      to.depth = (1 - b) * ((1 - a) * value(i, j) + a * value(i + 1, j)) +
                 b * ((1 - a) * value(i, j + 1) + a * value(i + 1, j + 1));
    }
}

/// How steeply the depth rises, per metre, in place of the waves. A shader knows the slope of each triangle
/// alone, which leaps from one to the next: borders that it shifts by that are cut straight there.
void rise(double cell, int W, int H, std::vector<PoolPlace>& fine) {
  const auto depth = [&](int x, int y) {
    return x < 0 || y < 0 || x >= W || y >= H ? 0.0f : fine[static_cast<std::size_t>(y * W + x)].depth;
  };
  for (int y = 0; y < H; ++y)
    for (int x = 0; x < W; ++x)
      fine[static_cast<std::size_t>(y * W + x)].waves =
          glm::length(glm::vec2(depth(x + 1, y) - depth(x - 1, y), depth(x, y + 1) - depth(x, y - 1))) /
          static_cast<float>(cell);
}

}  // namespace

Pool poolSurface(const Eigen::Isometry3d& origin, double cell, std::uint32_t columns, std::uint32_t rows,
                 const PoolCells& cells) {
  if (!(cell > 0) || !origin.matrix().allFinite()) return {};
  const int C = static_cast<int>(columns) + 2, R = static_cast<int>(rows) + 2;
  std::vector<PoolPlace> fine = refined(withShore(C - 2, R - 2, cells), C, R);
  frayShore(origin, cell, 2 * C - 1, 2 * R - 1, fine);
  return meshOf(origin, cell, C, R, fine, [](float depth) { return depth > kDryGround; });
}

Pool filmSurface(const Eigen::Isometry3d& origin, double cell, std::uint32_t columns, std::uint32_t rows,
                 const float* height, const std::uint8_t* thickness, const std::uint8_t* set) {
  if (!(cell > 0) || !origin.matrix().allFinite()) return {};
  constexpr int kRings = 2;  // of border cells: the noise takes blood beyond the first
  const int C = static_cast<int>(columns) + 2 * kRings, R = static_cast<int>(rows) + 2 * kRings;
  const auto at = [&](int c, int r) { return static_cast<std::size_t>(r * C + c); };
  std::vector<PoolPlace> coarse(static_cast<std::size_t>(C) * static_cast<std::size_t>(R));
  for (int r = kRings; r < R - kRings; ++r)
    for (int c = kRings; c < C - kRings; ++c) {
      const auto i = static_cast<std::size_t>((r - kRings) * static_cast<int>(columns) + c - kRings);
      if (!std::isfinite(height[i])) continue;
      PoolPlace& to = coarse[at(c, r)];
      to.height = height[i], to.weight = 1;
      to.depth = static_cast<float>(thickness[i]), to.blood = static_cast<float>(set[i]) / 255.0f;
    }
  for (int ring = 0; ring < kRings; ++ring) {
    const std::vector<PoolPlace> known = coarse;
    for (int r = 0; r < R; ++r)
      for (int c = 0; c < C; ++c) {
        PoolPlace& to = coarse[at(c, r)];
        if (to.weight > 0) continue;
        for (int y = std::max(r - 1, 0); y <= std::min(r + 1, R - 1); ++y)
          for (int x = std::max(c - 1, 0); x <= std::min(c + 1, C - 1); ++x) to.add(known[at(x, y)], 1);
        to.mean();
        // One cell between two with blood, as under a vessel: its rest is seen beside what lies there.
        to.depth = 0;
        for (const auto& [i, j] : {std::pair{1, 0}, {0, 1}, {1, 1}, {1, -1}}) {
          if (ring > 0 || c == 0 || c + 1 == C || r == 0 || r + 1 == R) break;
          to.depth =
              std::max(to.depth, std::min(known[at(c + i, r + j)].depth, known[at(c - i, r - j)].depth));
        }
      }
  }
  std::vector<PoolPlace> fine = refined(coarse, C, R);
  Eigen::Isometry3d X = origin;
  X.translation() -= origin.linear() * Vector3d((kRings - 1) * cell, (kRings - 1) * cell, 0);
  fray(X, cell, 2 * C - 1, 2 * R - 1, fine);
  rise(cell, 2 * C - 1, 2 * R - 1, fine);
  Pool film = meshOf(X, cell, C, R, fine, [](float micrometres) { return micrometres > 0; });
  for (std::size_t i = 0; i + 2 < film.features.size(); i += 3)
    std::swap(film.features[i], film.features[i + 1]);
  return film;
}

}  // namespace vest::effects

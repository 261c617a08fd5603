#include "vest_viz/effects/drops.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vest::effects {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

// Kinds that drops.frag knows.
constexpr float kDrop = 0.0f, kBubble = 1.0f, kStream = 2.0f;

constexpr float kFlying = 0.15f;   // m/s: slower ones run over tissue (assumed)
constexpr float kLongest = 0.05f;  // m: of a streak
constexpr float kReach = 6.0f;     // spacings between two particles of a stream at most (tuned)
constexpr float kThread = 0.025f;  // s: or so much of its way; a jet of 2 m/s holds together as long (tuned)
constexpr float kLongestThread = 0.04f;  // m
constexpr std::size_t kFew = 400;        // more that fly are no thin jets: looked at by kReach alone
constexpr float kNearest = 0.8f;         // spacings: nearer ones are a body of water, no thin stream
constexpr int kCrowd = 3;                // particles within 1.5 spacings make one, too
constexpr float kShed = 0.12f;           // of a drop's volume into each of its two satellites (by eye)
constexpr float kShedSpeed = 0.4f;       // m/s, from here on

/// A particle that is drawn.
struct Flying {
  Vector3f p, v;
  float radius;  ///< m, of a ball of its volume
  float hide;
  float share;  ///< of a whole particle
  int ahead = -1;
  bool followed = false;
  float stream = 0;  ///< m: radius of the stream here
};

void corner(const Vector3f& p, const Vector3f& numbers, float kind, float phase, Quads* q) {
  q->corners.insert(q->corners.end(), {p.x(), p.y(), p.z()});
  q->colours.insert(q->colours.end(), {numbers.x(), numbers.y(), numbers.z()});
  q->features.insert(q->features.end(), {1.0f, kind, phase});
}

/// Two directions across the line of sight; the first along `way` where that is seen.
void acrossSight(const Vector3f& sight, const Vector3f& way, Vector3f* u, Vector3f* w) {
  *u = way - way.dot(sight) * sight;
  if (u->norm() < 1e-9f)
    *u = std::fabs(sight.z()) < 0.9f ? sight.cross(Vector3f::UnitZ()) : sight.cross(Vector3f::UnitX());
  u->normalize();
  *w = sight.cross(*u);
}

void addBall(const Vector3f& p, const Vector3f& v, float radius, float hide, const Vector3f& camera,
             float shutter, Quads* q) {
  const Vector3f sight = (p - camera).normalized();
  const Vector3f moved = shutter * (v - v.dot(sight) * sight);
  const float length = std::min(moved.norm(), kLongest);
  // What lies on tissue is wider and flatter than a ball.
  const float flat = 1.0f - std::min(1.0f, v.norm() / kFlying), wide = radius * (1.0f + 0.3f * flat);
  Vector3f u, w;
  acrossSight(sight, length > 0.1f * radius ? moved : Vector3f::Zero(), &u, &w);
  const Vector3f middle = p - 0.5f * length * u;  // of the streak: half of it lies behind
  const Vector3f numbers(1e3f * wide, length / wide, hide);
  const Vector3f a = (wide + 0.5f * length) * u, b = wide * w;
  corner(middle - a - b, numbers, kDrop, flat, q), corner(middle + a - b, numbers, kDrop, flat, q);
  corner(middle + a + b, numbers, kDrop, flat, q), corner(middle - a + b, numbers, kDrop, flat, q);
}

void addStream(const Flying& from, const Flying& to, const Vector3f& camera, Quads* q) {
  const Vector3f way = to.p - from.p;
  Vector3f u, w;
  acrossSight((0.5f * (from.p + to.p) - camera).normalized(), way, &u, &w);
  const float stretch = way.norm() / std::max(from.stream, 1e-5f);
  const Vector3f a(1e3f * from.stream, stretch, from.hide), b(1e3f * to.stream, stretch, to.hide);
  corner(from.p - from.stream * w, a, kStream, 0, q), corner(to.p - to.stream * w, b, kStream, 0, q);
  corner(to.p + to.stream * w, b, kStream, 0, q), corner(from.p + from.stream * w, a, kStream, 0, q);
}

/// Cells of kReach spacings, sorted: the particles of a row of cells lie in one stretch.
class Neighbourhood {
 public:
  Neighbourhood(const std::vector<Flying>& all, float cell) : inverse_(1.0f / cell) {
    cells_.reserve(all.size());
    for (std::uint32_t i = 0; i < all.size(); ++i)
      if (all[i].v.squaredNorm() > kFlying * kFlying && all[i].share > 0.5f)
        cells_.emplace_back(key(place(all[i].p, 0), place(all[i].p, 1), place(all[i].p, 2)), i);
    std::sort(cells_.begin(), cells_.end());
  }
  const std::vector<std::pair<std::uint64_t, std::uint32_t>>& members() const { return cells_; }
  /// f(index) of all within a cell's width, until it says false.
  template <class F>
  void each(const Vector3f& p, F&& f) const {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y) {
        const std::int64_t x = place(p, 0), row_y = place(p, 1) + y, row_z = place(p, 2) + z;
        const std::uint64_t last = key(x + 1, row_y, row_z);
        auto at =
            std::lower_bound(cells_.begin(), cells_.end(), std::make_pair(key(x - 1, row_y, row_z), 0u));
        for (; at != cells_.end() && at->first <= last; ++at)
          if (!f(at->second)) return;
      }
  }

 private:
  std::int64_t place(const Vector3f& p, int axis) const {
    return static_cast<std::int64_t>(std::floor(std::clamp(p[axis], -100.0f, 100.0f) * inverse_));
  }
  static std::uint64_t key(std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kHalf = 1 << 20;
    return (static_cast<std::uint64_t>(z + kHalf) << 42) | (static_cast<std::uint64_t>(y + kHalf) << 21) |
           static_cast<std::uint64_t>(x + kHalf);
  }
  float inverse_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> cells_;
};

/// Finds who flies ahead of whom in thin streams.
void findStreams(float spacing, std::vector<Flying>* all) {
  const float widest = all->size() < kFew ? std::max(kReach * spacing, kLongestThread) : kReach * spacing;
  const Neighbourhood near(*all, widest);
  for (const auto& [cell, i] : near.members()) {
    Flying& a = (*all)[i];
    const float speed = a.v.norm();
    const Vector3f way = a.v / speed;
    int crowd = 0, best = -1;
    float gap = std::clamp(kThread * speed, kReach * spacing, widest);
    near.each(a.p, [&, i = i](std::uint32_t j) {
      if (j == i) return true;
      const Flying& b = (*all)[j];
      const Vector3f d = b.p - a.p;
      const float distance = d.norm(), along = d.dot(way), other = b.v.norm();
      crowd += distance < 1.5f * spacing;
      const bool same_way = b.v.dot(way) > 0.85f * other && other > 0.5f * speed && other < 2.0f * speed;
      if (same_way && distance < gap && along > 0.9f * distance && std::fabs(b.hide - a.hide) < 0.3f)
        gap = distance, best = static_cast<int>(j);
      return crowd < kCrowd;
    });
    if (best < 0 || crowd >= kCrowd || gap < kNearest * spacing || (*all)[best].followed) continue;
    a.ahead = best;
    (*all)[best].followed = true;
    // A cylinder of the particle's volume from one to the next.
    a.stream = std::min(a.radius, std::sqrt(a.share * spacing * spacing * spacing / (3.14159265f * gap)));
  }
}

/// A number 0 … 1 that stays with a drop in free flight: its horizontal velocity does.
float lot(const Vector3f& v, std::uint32_t which) {
  auto h = static_cast<std::uint32_t>(std::lround(30.0f * v.x())) * 73856093u ^
           static_cast<std::uint32_t>(std::lround(30.0f * v.y())) * 19349663u ^ which * 83492791u;
  h = (h ^ (h >> 13)) * 0x5bd1e995u;
  return static_cast<float>((h ^ (h >> 15)) & 0xffffu) / 65535.0f;
}

}  // namespace

float hiding(double blood) {
  return 1.0f - std::exp(-7.0f * static_cast<float>(std::clamp(blood, 0.0, 1.0)));
}

std::size_t addDrops(const FluidParticles& in, const Vector3d& eye, double shutter, Quads* q) {
  if (!(in.radius > 0 && in.radius < 0.1) || !eye.allFinite()) return in.count;
  std::size_t bad = 0;
  const Vector3f camera = eye.cast<float>();
  const auto spacing = static_cast<float>(2 * in.radius), open = static_cast<float>(shutter);
  std::vector<Flying> all;
  all.reserve(in.count);
  for (std::size_t i = 0; i < in.count; ++i) {
    Flying f;
    f.p = Vector3f(in.positions[3 * i], in.positions[3 * i + 1], in.positions[3 * i + 2]);
    f.v = Vector3f::Zero();
    if (in.velocities != nullptr)
      f.v = Vector3f(in.velocities[3 * i], in.velocities[3 * i + 1], in.velocities[3 * i + 2]);
    if (!f.p.allFinite() || !f.v.allFinite() || !(f.p - camera).normalized().allFinite()) {
      ++bad;
      continue;
    }
    f.share = in.volume != nullptr ? in.volume[i] / 255.0f : 1.0f;
    f.radius = spacing * std::cbrt(f.share * 0.238732415f);  // a ball of the volume: 3/(4 pi)
    f.hide = hiding(in.blood != nullptr ? in.blood[i] / 255.0 : 1.0);
    if (f.radius > 0) all.push_back(f);
  }
  findStreams(spacing, &all);
  for (Flying& f : all)
    if (f.ahead < 0) f.stream = 0.8f * f.radius;  // the drop at the head of a stream
  for (const Flying& f : all) {
    if (f.ahead >= 0) {
      addStream(f, all[static_cast<std::size_t>(f.ahead)], camera, q);
      continue;
    }
    const float speed = f.v.norm();
    if (f.followed || f.share < 0.5f || speed < kShedSpeed) {
      addBall(f.p, f.v, f.radius, f.hide, camera, open, q);
      continue;
    }
    addBall(f.p, f.v, f.radius * std::cbrt(1 - 2 * kShed), f.hide, camera, open, q);
    for (std::uint32_t k = 0; k < 2; ++k) {
      const Vector3f side(lot(f.v, 4 * k) - 0.5f, lot(f.v, 4 * k + 1) - 0.5f, lot(f.v, 4 * k + 2) - 0.5f);
      const float behind = (k == 0 ? -2.0f : 1.6f) * (1 + lot(f.v, 4 * k + 3));
      addBall(f.p + f.radius * (behind * f.v / speed + 2.4f * side), f.v, f.radius * std::cbrt(kShed), f.hide,
              camera, open, q);
    }
  }
  return bad;
}

void addBubbles(const float* bubbles, std::size_t count, const Vector3d& eye, Quads* q) {
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3f p(bubbles[4 * i], bubbles[4 * i + 1], bubbles[4 * i + 2]);
    const float r = bubbles[4 * i + 3];
    if (!p.allFinite() || !(r > 0 && r < 0.1f)) continue;
    const Vector3f sight = (p - eye.cast<float>()).normalized();
    Vector3f u, w;
    acrossSight(sight, Vector3f::Zero(), &u, &w);
    const Vector3f numbers(1e3f * r, 0, 0), a = r * u, b = r * w;
    corner(p - a - b, numbers, kBubble, 0, q), corner(p + a - b, numbers, kBubble, 0, q);
    corner(p + a + b, numbers, kBubble, 0, q), corner(p - a + b, numbers, kBubble, 0, q);
  }
}

}  // namespace vest::effects

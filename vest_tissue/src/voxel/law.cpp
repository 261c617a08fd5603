#include "vest_tissue/voxel/law.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace vest::voxel {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSoftest = 0.25;  // of the mean: softer voxels count as this; skin's are blurred with air
constexpr double kLeastShare = 0.0625;  // next to a voxel that was not measured the spline gives at most this
constexpr double kFilter = 0.003;       // s, low-pass of the speed: that of the haptic loop
constexpr double kDrop = 0.020;  // s in which a broken capsule lets go, at least what a hand needs (assumed)
constexpr double kShaftStep = 0.002;    // m between places at which the shaft's friction is asked for
constexpr int kMostShaft = 140;         // such places: 280 mm, the longest insertion of the box
constexpr double kHole = 0.002;         // m aside of its channel at which a needle cuts a new one (assumed)
constexpr double kSettled = 0.0005;     // m that a tip moves before a region may change again (assumed)
constexpr double kProbeFriction = 0.1;  // Coulomb, wet tissue: that of organs in scenes
constexpr double kCreep = 3e-5;         // m a tick that a probe's point may catch up (tuned)
constexpr int kSearch = 4;              // Newton steps of a probe's point a tick
constexpr double kFarthest = 0.001;     // m a step of those
constexpr double kOnSurface = 0.0003;   // m, the last of them: beyond it there is no surface to stand on

double norm(const Vector3d& v) noexcept {
  return std::sqrt(v.squaredNorm());
}

Vector3d gridOf(const Header& h, const Vector3d& p) noexcept {
  Vector3d g;
  for (int a = 0; a < 3; ++a)
    g[a] = h.to_grid[a][0] * p[0] + h.to_grid[a][1] * p[1] + h.to_grid[a][2] * p[2] + h.to_grid[a][3];
  return g;
}

template <bool Gradient>
Sampled sampled(const View& view, const Vector3d& place) noexcept {
  Sampled out;
  if (!view) return out;
  const Header& h = *view.header;
  const Vector3d grid = gridOf(h, place);
  int first[3];
  double w[3][4], d[3][4];
  for (int a = 0; a < 3; ++a) {
    // Also false for what is no number.
    if (!(grid[a] > -2.0 && grid[a] < static_cast<double>(h.size[a]) + 1.0)) return out;
    const double low = std::floor(grid[a]), u = grid[a] - low, v = 1.0 - u;
    first[a] = static_cast<int>(low) - 1;
    w[a][0] = v * v * v / 6.0;
    w[a][1] = (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0;
    w[a][2] = (4.0 - 6.0 * v * v + 3.0 * v * v * v) / 6.0;
    w[a][3] = u * u * u / 6.0;
    if (Gradient) {
      d[a][0] = -0.5 * v * v;
      d[a][1] = -2.0 * u + 1.5 * u * u;
      d[a][2] = 2.0 * v - 1.5 * v * v;
      d[a][3] = 0.5 * u * u;
    }
  }
  double all = 0, sum = 0, all_by[3] = {}, sum_by[3] = {};
  for (int k = 0; k < 4; ++k) {
    const int z = first[2] + k;
    if (z < 0 || z >= static_cast<int>(h.size[2])) continue;
    for (int j = 0; j < 4; ++j) {
      const int y = first[1] + j;
      if (y < 0 || y >= static_cast<int>(h.size[1])) continue;
      const std::int16_t* const row =
          view.stored + (static_cast<std::size_t>(z) * h.size[1] + static_cast<std::size_t>(y)) * h.size[0];
      double row_all = 0, row_sum = 0, row_all_x = 0, row_sum_x = 0;
      for (int i = 0; i < 4; ++i) {
        const int x = first[0] + i;
        if (x < 0 || x >= static_cast<int>(h.size[0]) || row[x] == kNothing) continue;
        const double n = row[x];
        row_all += w[0][i];
        row_sum += w[0][i] * n;
        if (Gradient) {
          row_all_x += d[0][i];
          row_sum_x += d[0][i] * n;
        }
      }
      const double yz = w[1][j] * w[2][k];
      all += yz * row_all;
      sum += yz * row_sum;
      if (Gradient) {
        const double dy = d[1][j] * w[2][k], dz = w[1][j] * d[2][k];
        all_by[0] += yz * row_all_x, sum_by[0] += yz * row_sum_x;
        all_by[1] += dy * row_all, sum_by[1] += dy * row_sum;
        all_by[2] += dz * row_all, sum_by[2] += dz * row_sum;
      }
    }
  }
  if (!(all > kLeastShare)) return out;
  const double mean = sum / all;
  out.share = std::min(1.0, (all - kLeastShare) / (1.0 - kLeastShare));
  out.value = h.intercept + h.slope * mean;
  if (Gradient) {
    Vector3d g;
    for (int a = 0; a < 3; ++a) g[a] = h.slope * (sum_by[a] - mean * all_by[a]) / all;
    for (int a = 0; a < 3; ++a)
      out.gradient[a] = h.to_grid[0][a] * g[0] + h.to_grid[1][a] * g[1] + h.to_grid[2][a] * g[2];
  }
  return out;
}

// Which region the tip is in now. A capsule holds it until the tip goes back or presses hard enough.
void crossRegions(const View& view, const Motion& m, const Vector3d& axis, double pressed, bool tissue,
                  ToolState& s, Felt& felt) noexcept {
  const Header& h = *view.header;
  const std::uint8_t here = regionAt(view, m.tip);
  const auto enter = [&](std::uint8_t region) {
    felt.left = s.region;
    felt.entered = s.region = region;
    s.pending = 0;
    s.crossed = m.tip;
  };
  if (s.pending != 0) {
    // The point may be beyond a thin region by the time that it gives way.
    if (pressed >= s.held) {
      felt.broke = s.held;
      enter(s.pending);
    } else if ((m.tip - s.crossed).dot(axis) <= 0.0) {
      s.pending = 0;
    }
  } else if (here != s.region && h.capsule[here] > 0.0 && s.ahead == 0.0 && m.kind == Kind::Needle) {
    s.pending = here;
    s.crossed = s.tip;
    s.held = h.capsule[here];
    s.drop = s.held / kDrop;
  } else if (here != s.region && (m.tip - s.crossed).squaredNorm() > kSettled * kSettled) {
    enter(here);
  }
  if (s.pending == 0) s.held = tissue ? std::max(0.0, s.held - s.drop * m.dt) : 0.0;
}

void needle(const View& view, const Motion& m, ToolState& s, Felt& felt) noexcept {
  const Header& h = *view.header;
  const Sampled at = sampleValue(view, m.tip);
  const Feel feel = feelOf(h, at.value);
  const double yield = at.share * feel.yield;
  felt.value = at.value;
  felt.tissue = at.share > 0.0;
  const Vector3d moved = m.tip - s.tip, along = m.tip - m.pivot;
  const double length = norm(along);
  const Vector3d axis = length > 1e-9 ? Vector3d(along / length) : Vector3d(0.0, 0.0, -1.0);
  const double k = 0.5 * std::min(h.needle_stiffness, m.most_stiffness);
  // A spring that stiffens keeps its force and loses energy; one that softens keeps its length.
  if (k > s.stiffness && k > 0.0) {
    s.spring *= s.stiffness / k;
    s.shaft *= s.stiffness / k;
  }
  s.stiffness = k;

  // The tip.
  s.spring += moved;
  const double forward = s.spring.dot(axis);
  if (forward < 0.0) {
    s.ahead += -forward;
    s.spring -= forward * axis;
  } else if (s.ahead > 0.0) {
    const double used = std::min(s.ahead, forward);
    s.ahead -= used;
    s.spring -= used * axis;
  }
  const double pressed = k * norm(s.spring);
  crossRegions(view, m, axis, pressed, yield > 0.0, s, felt);
  const double bound = std::max(yield, s.held);
  Vector3d slipped = Vector3d::Zero();
  if (pressed > bound) {
    const Vector3d kept = s.spring * (bound / pressed);
    slipped = s.spring - kept;
    s.spring = kept;
  }
  if (s.ahead > 0.0) {
    s.aside += slipped - slipped.dot(axis) * axis;
    if (s.aside.squaredNorm() > kHole * kHole) s.ahead = 0.0;
  }
  if (s.ahead == 0.0) s.aside.setZero();

  // The shaft.
  double grip = 0.0;
  const int places = std::min(kMostShaft, static_cast<int>(length / kShaftStep));
  for (int i = 0; i < places; ++i) {
    const Sampled there = sampleValue(view, m.tip - (i + 0.5) * kShaftStep * axis);
    if (there.share > 0.0) grip += there.share * feelOf(h, there.value).friction * kShaftStep;
  }
  s.shaft += moved.dot(axis);
  if (k * std::abs(s.shaft) > grip) s.shaft = k > 0.0 ? (s.shaft < 0.0 ? -grip : grip) / k : 0.0;

  felt.force = -k * (s.spring + s.shaft * axis) - at.share * feel.viscosity * s.velocity;
  felt.stiffness = 2.0 * k;
  // What the low-passed speed holds is that of a spring in series with its damper.
  felt.stored = 0.5 * k * (s.spring.squaredNorm() + s.shaft * s.shaft) +
                0.5 * at.share * feel.viscosity * kFilter * s.velocity.squaredNorm();
}

// Newton's way along the gradient to the surface; false where there is none to follow.
bool toSurface(const View& view, Vector3d& p, Vector3d& normal, double& way) noexcept {
  const Sampled at = sample(view, p);
  const double square = at.gradient.squaredNorm();
  if (!(at.share > 0.0) || !(square > 0.0)) return false;
  normal = -at.gradient / std::sqrt(square);
  way = std::clamp((at.value - view.header->surface) / std::sqrt(square), -kFarthest, kFarthest);
  p += way * normal;
  return true;
}

// Layers give way in series, and in parallel as far as they spread the load. Between both lies the exact
// stiffness of a layer bonded to other ground (Burmister 1945). Four parts of the mean by the inverse root
// and one of the harmonic mean keep within 4 % of it for moduli of up to 4 : 1 (fitted to 48 layers of 0.5 to
// 6 radii).
double stiffnessBelow(const View& view, const Vector3d& p, const Vector3d& normal) noexcept {
  const Header& h = *view.header;
  double weight[kDepths], k[kDepths];
  double sum = 0.0, all = 0.0;
  for (int i = 0; i < kDepths; ++i) {
    const Sampled at = sampleValue(view, p - h.depth[i] * normal);
    weight[i] = at.share > 0.0 ? h.weight[i] * at.share : 0.0;  // below the image it goes on as above
    k[i] = weight[i] > 0.0 ? feelOf(h, at.value).stiffness : 0.0;
    sum += weight[i] * k[i];
    all += weight[i];
  }
  if (!(sum > 0.0)) return 0.0;
  const double least = kSoftest * sum / all;
  double root = 0.0, inverse = 0.0;
  for (int i = 0; i < kDepths; ++i) {
    root += weight[i] / std::sqrt(std::max(k[i], least));
    inverse += weight[i] / std::max(k[i], least);
  }
  return 0.8 * (all / root) * (all / root) + 0.2 * all / inverse;
}

void probe(const View& view, const Motion& m, ToolState& s, Felt& felt) noexcept {
  const Header& h = *view.header;
  const Sampled at = sampleValue(view, m.tip);
  felt.value = at.value;
  felt.tissue = at.share > 0.0;
  const bool inside = felt.tissue && at.value > h.surface;
  crossRegions(view, m, Vector3d::Zero(), 0.0, inside, s, felt);
  if (!s.touching) {
    if (!inside) {
      s.outside = true;
      return;
    }
    if (!s.outside) return;
    // It came in within this tick: the surface lies between.
    Vector3d out = s.tip, in = m.tip;
    for (int i = 0; i < 20; ++i) {
      const Vector3d middle = 0.5 * (out + in);
      const Sampled there = sampleValue(view, middle);
      (there.share > 0.0 && there.value > h.surface ? in : out) = middle;
    }
    s.spring = in;
    s.touching = true;
  }
  Vector3d p = s.spring;
  Vector3d n = s.normal;
  double way = 0.0;
  bool found = toSurface(view, p, n, way);
  if (found) {
    // It slides as far as the tip is beyond the cone of friction, and no faster than the hand.
    const Vector3d d = m.tip - p;
    const Vector3d across = d - d.dot(n) * n;
    const double far = norm(across), beyond = far - kProbeFriction * std::abs(d.dot(n));
    if (beyond > 0.0) p += across * (std::min(beyond, norm(m.tip - s.tip) + kCreep) / far);
    for (int i = 1; i < kSearch && found; ++i) found = toSurface(view, p, n, way);
  }
  if (!found || std::abs(way) > kOnSurface || (m.tip - p).dot(n) >= 0.0) {
    s.touching = false;
    s.outside = !inside;
    s.spring.setZero();
    s.normal.setZero();
    return;
  }
  s.spring = p;
  s.normal = n;
  const double k = std::min(stiffnessBelow(view, p, n), m.most_stiffness);
  felt.force = k * (p - m.tip);
  felt.stiffness = k;
  felt.stored = 0.5 * k * (p - m.tip).squaredNorm();
}

}  // namespace

Sampled sample(const View& view, const Vector3d& place) noexcept {
  return sampled<true>(view, place);
}

Sampled sampleValue(const View& view, const Vector3d& place) noexcept {
  return sampled<false>(view, place);
}

Feel feelOf(const Header& h, double value) noexcept {
  const Feel* const end = h.table + std::min<std::uint32_t>(h.rows, kMostRows);
  if (end == h.table) return {};
  if (!(value > h.table[0].value)) return h.table[0];
  if (value >= end[-1].value) return end[-1];
  const Feel* const above =
      std::upper_bound(h.table, end, value, [](double v, const Feel& row) { return v < row.value; });
  const Feel &a = above[-1], &b = *above;
  const double t = (value - a.value) / (b.value - a.value);
  const auto mix = [t](double x, double y) { return x + t * (y - x); };
  return {value, mix(a.stiffness, b.stiffness), mix(a.yield, b.yield), mix(a.viscosity, b.viscosity),
          mix(a.friction, b.friction)};
}

std::uint8_t regionAt(const View& view, const Vector3d& place) noexcept {
  if (!view) return 0;
  const Header& h = *view.header;
  const Vector3d grid = gridOf(h, place);
  std::size_t voxel[3];
  for (int a = 0; a < 3; ++a) {
    const double nearest = std::floor(grid[a] + 0.5);
    if (!(nearest >= 0.0 && nearest < h.size[a])) return 0;
    voxel[a] = static_cast<std::size_t>(nearest);
  }
  const std::uint8_t found = view.region[(voxel[2] * h.size[1] + voxel[1]) * h.size[0] + voxel[0]];
  return found < kMostRegions ? found : std::uint8_t{0};
}

Felt step(const View& view, const Motion& motion, ToolState& s) noexcept {
  Felt felt;
  Motion m = motion;
  const Vector3d along = m.tip - m.pivot;
  const double length = norm(along);
  const Vector3d axis = length > 1e-3 ? Vector3d(along / length) : Vector3d::Zero();
  m.tip += m.reach * axis;
  if (!view || m.kind == Kind::None) {
    s = ToolState{};
    return felt;
  }
  if (s.kind != m.kind) {
    s = ToolState{};
    s.kind = m.kind;
    s.tip = s.crossed = m.tip;
    s.region = regionAt(view, m.tip);
  }
  s.velocity += m.dt / (m.dt + kFilter) * ((m.tip - s.tip) / m.dt - s.velocity);
  if (m.kind == Kind::Needle)
    needle(view, m, s, felt);
  else
    probe(view, m, s, felt);
  s.tip = felt.tip = m.tip;
  // By virtual work about the pivot: what acts across at the point acts by its lever at the tool's frame.
  if (length > 1e-3 && m.reach > 0.0) {
    const Vector3d ahead = felt.force.dot(axis) * axis;
    felt.force = ahead + (felt.force - ahead) * ((length + m.reach) / length);
  }
  return felt;
}

}  // namespace vest::voxel

#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

constexpr int kLines = 8;  ///< vertical lines along each side of a cell, on which a capsule is met (tuned)
/// Most of a cell's area that a wave finds taken: it runs √2 times as fast there, which the pool's parts of a
/// step leave room for (tuned).
constexpr float kMostArea = 0.5f;
/// Most of a cell's column that instruments take: a level needs liquid (tuned).
constexpr float kMostColumn = 0.9f;
constexpr int kLevels = 12;  ///< times that a level is found anew: each halves what is wrong, or better
/// Of a cell's depth: no level stands as high over its bed, for of its column c instruments take at most
/// kMostColumn c, and the liquid keeps its depth. The rest is for rounding.
constexpr float kHighest = 1.01f / (1.0f - kMostColumn);
constexpr float kRounding = 1e-4f;  ///< m: far more than rounding moves a capsule

/// Heights between which a vertical line lies in a body; none where high < low.
struct Span {
  float low = 1, high = 0;
  void add(float l, float h) {
    if (high < low) low = l, high = h;
    low = std::min(low, l), high = std::max(high, h);
  }
};

/// Of a capsule, which is convex: the outermost heights of its cylinder and its two balls.
/// @param x, y of the line, against the capsule's first end  @param along to its other end
Span meet(float x, float y, const float* along, float length, float radius) {
  Span span;
  const float square = radius * radius;
  const auto ball = [&](float cx, float cy, float cz) {
    const float rest = square - (x - cx) * (x - cx) - (y - cy) * (y - cy);
    if (rest > 0) span.add(cz - std::sqrt(rest), cz + std::sqrt(rest));
  };
  ball(0, 0, 0), ball(along[0], along[1], along[2]);
  if (!(length > 0)) return span;
  const float ax = along[0] / length, ay = along[1] / length, az = along[2] / length;
  // |p − (p·a)a|² = r² with p = (x, y, z): a quadratic in z.
  const float flat = x * ax + y * ay, a = 1 - az * az, b = -flat * az,
              c = x * x + y * y - flat * flat - square;
  float low = -1e3f, high = 1e3f;
  if (a > 1e-6f) {
    const float root = b * b - a * c;
    if (!(root > 0)) return span;
    low = (-b - std::sqrt(root)) / a, high = (-b + std::sqrt(root)) / a;
  } else if (c > 0) {
    return span;
  }
  // Between its ends: 0 ≤ flat + z az ≤ length.
  if (std::fabs(az) > 1e-6f) {
    const float p = -flat / az, q = (length - flat) / az;
    low = std::max(low, std::min(p, q)), high = std::min(high, std::max(p, q));
  } else if (flat < 0 || flat > length) {
    return span;
  }
  if (low < high) span.add(low, high);
  return span;
}

/// What instruments take of a cell's column: m up to a level, and of its area at the level.
struct Taken {
  float column = 0, area = 0;
};
Taken takenOf(const ScratchData& s, std::size_t cell, float bed, float level) {
  // Each line stands for a part of the four cells around it, so that a shaft goes smoothly from one to
  // another.
  constexpr float kPart = 0.25f / (kLines * kLines);
  Taken t;
  for (std::int32_t k = s.first_line[cell]; k >= 0; k = s.lines[static_cast<std::size_t>(k)].next) {
    const ImmersedLine& line = s.lines[static_cast<std::size_t>(k)];
    if (line.low >= level) continue;
    t.column += kPart * std::max(0.0f, std::min(line.high, level) - std::max(line.low, bed));
    if (line.high > level) t.area += kPart;
  }
  t.column = std::min(t.column, kMostColumn * (level - bed)), t.area = std::min(t.area, kMostArea);
  return t;
}

void addLines(const Model& model, const Obstacle& o, const Pools& w, ScratchData& s) {
  const auto cell = static_cast<float>(model.parameters.pool_cell), step = cell / kLines,
             x0 = static_cast<float>(model.parameters.low[0]),
             y0 = static_cast<float>(model.parameters.low[1]), radius = static_cast<float>(o.radius);
  float a[3], along[3], low[2], high[2];
  for (std::size_t i = 0; i < 3; ++i) {
    a[i] = static_cast<float>(o.a[i]), along[i] = static_cast<float>(o.b[i] - o.a[i]);
    if (i == 2) break;
    low[i] = std::min(a[i], a[i] + along[i]) - radius;
    high[i] = std::max(a[i], a[i] + along[i]) + radius;
  }
  const float length = std::sqrt(along[0] * along[0] + along[1] * along[1] + along[2] * along[2]);
  const int columns = kLines * model.columns, rows = kLines * model.rows;
  const auto index = [&](float at, float from) { return CellGrid::floorInt((at - from) / step); };
  const int c0 = std::max(0, index(low[0], x0)), c1 = std::min(columns - 1, index(high[0], x0)),
            r0 = std::max(0, index(low[1], y0)), r1 = std::min(rows - 1, index(high[1], y0));
  const auto reaches = [&](std::size_t i, float z) {
    return w.depth[i] > kDryDepth && z < w.bed[i] + kHighest * w.depth[i];
  };
  const auto wet = [&](int row, int column, float z) {
    return row >= 0 && column >= 0 && row < model.rows && column < model.columns &&
           reaches(static_cast<std::size_t>(row) * static_cast<std::size_t>(model.columns) +
                       static_cast<std::size_t>(column),
                   z);
  };
  // Of the axis, what may be near places from … to along one direction.
  const auto share = [&](int axis, float low_place, float high_place, float& from, float& to) {
    if (!(std::fabs(along[axis]) > 1e-6f)) return;
    const float near = radius + kRounding, p = (low_place - near - a[axis]) / along[axis],
                q = (high_place + near - a[axis]) / along[axis];
    from = std::max(from, std::min(p, q)), to = std::min(to, std::max(p, q));
  };
  // m: no part of it over this row, and over the lines of this cell, is lower.
  const auto lowestOver = [&](int r, int column) {
    float from = 0, to = 1;
    const float y = y0 + (static_cast<float>(r) + 0.5f) * step, x = x0 + static_cast<float>(column) * cell;
    share(1, y, y, from, to), share(0, x, x + cell, from, to);
    return from > to ? 1e9f : a[2] + std::min(from * along[2], to * along[2]) - radius - kRounding;
  };
  for (int r = r0; r <= r1; ++r) {
    const int row = r / kLines, up = 2 * (r % kLines) >= kLines ? 1 : -1;
    // Of its footprint, what can lie on this row.
    const float y = y0 + (static_cast<float>(r) + 0.5f) * step - a[1];
    float from = 0, to = 1;
    if (std::fabs(along[1]) > 1e-6f) {
      const float p = (y - radius) / along[1], q = (y + radius) / along[1];
      from = std::max(from, std::min(p, q)), to = std::min(to, std::max(p, q));
    }
    const float begin = from * along[0], end = to * along[0];
    const int first = std::max(c0, index(a[0] - radius + std::min(begin, end), x0) - 1),
              last = std::min(c1, index(a[0] + radius + std::max(begin, end), x0) + 1);
    for (int c = first; c <= last; ++c) {
      // The cell that it stands in, and those on whose side of it the line is.
      const int column = c / kLines, right = 2 * (c % kLines) >= kLines ? 1 : -1;
      // All lines of a cell at once, where no liquid around it reaches the capsule.
      if (c == first || c % kLines == 0) {
        bool any = false;
        const float z = lowestOver(r, column);
        for (int cc = column - 1; cc <= column + 1; ++cc)
          any = any || wet(row, cc, z) || wet(row + up, cc, z);
        if (!any) {
          c = (column + 1) * kLines - 1;
          continue;
        }
      }
      Span in;
      bool met = false;
      for (int k = 0; k < 4; ++k) {
        const int cc = column + (k & 1) * right, rr = row + (k >> 1) * up;
        if (cc < 0 || rr < 0 || cc >= model.columns || rr >= model.rows) continue;
        const std::size_t i = static_cast<std::size_t>(rr) * static_cast<std::size_t>(model.columns) +
                              static_cast<std::size_t>(cc);
        if (!(w.depth[i] > kDryDepth)) continue;
        if (!met) {
          in = meet(x0 + (static_cast<float>(c) + 0.5f) * step - a[0], y, along, length, radius);
          met = true;
        }
        if (!(in.low < in.high) || in.high + a[2] < w.bed[i] || !reaches(i, in.low + a[2]) ||
            s.lines.size() == s.lines.capacity())
          continue;
        if (s.first_line[i] < 0) s.immersed.push_back({static_cast<std::uint32_t>(i), 0, 0});
        s.lines.push_back({in.low + a[2], in.high + a[2], s.first_line[i]});
        s.first_line[i] = static_cast<std::int32_t>(s.lines.size() - 1);
      }
    }
  }
}

}  // namespace

void immerse(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  Pools& w = state.pools;
  for (const ImmersedCell& cell : s.immersed) s.first_line[cell.cell] = -1;
  s.immersed.clear(), s.lines.clear();
  std::fill(w.raised.begin(), w.raised.end(), 0.0f);
  for (int k = 0; k < inputs.obstacle_count; ++k)
    addLines(model, inputs.obstacles[static_cast<std::size_t>(k)], w, s);
  for (ImmersedCell& cell : s.immersed) {
    const std::size_t i = cell.cell;
    Taken taken;
    for (int k = 0; k < kLevels; ++k) {
      taken = takenOf(s, i, w.bed[i], w.top(i));
      const bool found = taken.column == w.raised[i];  // the next would be the same
      w.raised[i] = taken.column;
      if (found) break;
    }
    w.head[i] += w.raised[i];
    cell.slope = taken.area / (1 - taken.area), cell.depth = w.depth[i];
  }
}

void followLevel(State& state, ScratchData& s) {
  Pools& w = state.pools;
  for (ImmersedCell& cell : s.immersed) {
    const float more = std::max(cell.slope * (w.depth[cell.cell] - cell.depth), -w.raised[cell.cell]);
    w.raised[cell.cell] += more, w.head[cell.cell] += more;
    cell.depth = w.depth[cell.cell];
  }
}

}  // namespace vest::fluid

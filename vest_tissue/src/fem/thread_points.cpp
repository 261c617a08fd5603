#include <algorithm>
#include <array>
#include <cmath>

#include "vest_tissue/fem/tissue.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kRounds = 4;                // of Newton's method, at most (tuned)
constexpr double kSettledTension = 0.01;  // relative change of the tension at which they end (tuned)
constexpr double kShortestLink = 1e-5;    // m: a link is no stiffer across than one of this length (tuned)
constexpr int kMostRows = 3 * static_cast<int>(kMostThreadPoints);

/// Lower Cholesky factor in place, column by column: columns are contiguous. False: not positive definite.
bool factorDense(double* a, int n) {
  for (int k = 0; k < n; ++k) {
    double* const own = a + static_cast<std::ptrdiff_t>(k) * kMostRows;
    if (!(own[k] > 0.0)) return false;
    const double root = std::sqrt(own[k]);
    for (int i = k; i < n; ++i) own[i] /= root;
    for (int j = k + 1; j < n; ++j) {
      double* const other = a + static_cast<std::ptrdiff_t>(j) * kMostRows;
      const double f = own[j];
      for (int i = j; i < n; ++i) other[i] -= f * own[i];
    }
  }
  return true;
}

void solveDense(const double* a, int n, double* x) {
  for (int k = 0; k < n; ++k) {
    const double* const own = a + static_cast<std::ptrdiff_t>(k) * kMostRows;
    x[k] /= own[k];
    for (int i = k + 1; i < n; ++i) x[i] -= x[k] * own[i];
  }
  for (int k = n - 1; k >= 0; --k) {
    const double* const own = a + static_cast<std::ptrdiff_t>(k) * kMostRows;
    for (int i = k + 1; i < n; ++i) x[k] -= own[i] * x[i];
    x[k] /= own[k];
  }
}

using Links = std::array<Vector3d, kMostThreadPoints>;

Vector3d unit(const Vector3d& d) {
  const double l = std::sqrt(d.squaredNorm());
  return l > 1e-12 ? Vector3d(d / l) : Vector3d(Vector3d::Zero());
}

}  // namespace

void solveThread(TissueScratch& w, TissueThread& thread, double h, const Vector3d* start, Vector3d* end) {
  // Corners of the closed way: the points, and the knot that the applicator holds, which does not give.
  const int points = thread.count, links = points + (thread.held ? 1 : 0);
  const auto first = static_cast<std::size_t>(thread.first);
  const double tension_before = thread.tension;
  thread.tension = 0.0;
  if (points < 2 || links > static_cast<int>(kMostThreadPoints)) return;
  const auto at = [&](const Vector3d* places, const Vector3d& knot, int i) -> const Vector3d& {
    return i < points ? places[first + static_cast<std::size_t>(i)] : knot;
  };
  Links way, now;  // of the links: without the thread, and as they are guessed
  double length = 0.0, free = 0.0;
  for (int l = 0; l < links; ++l) {
    const int j = (l + 1) % links;
    const Vector3d is = at(start, thread.knot, j) - at(start, thread.knot, l);
    way[l] = at(end, thread.knot_end, j) - at(end, thread.knot_end, l);
    length += std::sqrt(is.squaredNorm());
    free += std::sqrt(way[l].squaredNorm());
    now[l] = at(start, thread.knot_end, j) - at(start, thread.knot_end, l);
  }
  const double target = std::max(thread.length, length - thread.fastest * h);
  if (!(free > target)) return;  // slack
  const auto D = [&](int p, int q) -> Matrix3d {
    if (p >= points || q >= points) return Matrix3d::Zero();
    return w.answers[(first + static_cast<std::size_t>(p)) * kMostTissuePoints + first +
                     static_cast<std::size_t>(q)];
  };
  const auto pair = [](int l, int m) { return static_cast<std::size_t>(l) * kMostThreadPoints + m; };
  for (int l = 0; l < links; ++l) {
    const int lj = (l + 1) % links;
    for (int m = 0; m <= l; ++m) {
      const int mj = (m + 1) % links;
      const Matrix3d c = D(lj, mj) - D(lj, m) - D(l, mj) + D(l, m);
      w.thread_answers[pair(l, m)] = c;
      w.thread_answers[pair(m, l)] = c.transpose();
    }
  }
  // A link with vector r pulls its ends together with F = T u + (T/|d|) P (r - d), d: its vector as guessed,
  // u = d/|d|, P = I - u u^T; r = way - C F. With S = sqrt(T/|d|) P and s = S r, since P d = 0:
  //   (I + S C S) s = S way - T S C u,  F = T u + S s;   T such that the sum of u·r is what it may be.
  const int rows = 3 * links;
  std::array<Matrix3d, kMostThreadPoints> S;
  std::array<double, kMostRows> s0, s1;
  double tension = tension_before;
  Links u, force;
  for (int round = 0; round < kRounds; ++round) {
    for (int l = 0; l < links; ++l) {
      u[l] = unit(now[l]);
      const double stiff = tension / std::max(std::sqrt(now[l].squaredNorm()), kShortestLink);
      S[l] = std::sqrt(stiff) * (Matrix3d::Identity() - u[l] * u[l].transpose());
    }
    for (int l = 0; l < links; ++l) {
      Vector3d along = Vector3d::Zero();
      for (int m = 0; m < links; ++m) along += w.thread_answers[pair(l, m)] * u[m];
      const Vector3d a = S[l] * way[l], b = S[l] * along;
      for (int axis = 0; axis < 3; ++axis) s0[3 * l + axis] = a[axis], s1[3 * l + axis] = b[axis];
      for (int m = 0; m <= l; ++m) {
        Matrix3d block = S[l] * w.thread_answers[pair(l, m)] * S[m];
        if (l == m) block += Matrix3d::Identity();
        for (int x = 0; x < 3; ++x)
          for (int y = 0; y < 3; ++y)
            w.thread_matrix[static_cast<std::size_t>(3 * m + y) * kMostRows + 3 * l + x] = block(x, y);
      }
    }
    if (!factorDense(w.thread_matrix.data(), rows)) return;
    solveDense(w.thread_matrix.data(), rows, s0.data());
    solveDense(w.thread_matrix.data(), rows, s1.data());
    // F = f0 + T f1
    Links f1;
    for (int l = 0; l < links; ++l) {
      force[l] = S[l] * Vector3d(s0[3 * l], s0[3 * l + 1], s0[3 * l + 2]);
      f1[l] = u[l] - S[l] * Vector3d(s1[3 * l], s1[3 * l + 1], s1[3 * l + 2]);
    }
    double longer = -target, shorter = 0.0;  // m, m/N
    Links r0, r1;
    for (int l = 0; l < links; ++l) {
      r0[l] = way[l], r1[l].setZero();
      for (int m = 0; m < links; ++m) {
        r0[l] -= w.thread_answers[pair(l, m)] * force[m];
        r1[l] += w.thread_answers[pair(l, m)] * f1[m];
      }
      longer += u[l].dot(r0[l]);
      shorter += u[l].dot(r1[l]);
    }
    const double before = tension;
    tension = shorter > 1e-30 ? std::clamp(longer / shorter, 0.0, thread.most) : 0.0;
    for (int l = 0; l < links; ++l) now[l] = r0[l] - tension * r1[l];
    if (std::fabs(tension - before) <= kSettledTension * tension) break;
  }
  if (!std::isfinite(tension)) return;
  // Every link pulls with the tension along itself, whatever the rounds have left: opposite forces in one
  // line.
  thread.tension = tension;
  for (int l = 0; l < links; ++l) {
    const Vector3d pull = tension * unit(now[l]);
    const int j = (l + 1) % links;
    if (l < points) w.points[first + static_cast<std::size_t>(l)].force += pull;
    if (j < points) w.points[first + static_cast<std::size_t>(j)].force -= pull;
  }
  for (std::size_t p = 0; p < w.points.size(); ++p)
    for (std::size_t q = first; q < first + static_cast<std::size_t>(points); ++q)
      end[p] += w.answers[p * kMostTissuePoints + q] * w.points[q].force;
}

}  // namespace vest::fem

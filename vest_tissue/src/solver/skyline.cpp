#include "vest_tissue/solver/skyline.h"

#include <algorithm>

namespace vest::solver {
namespace {

/// Four running sums: a fixed order that vectorises.
double dot(const double* a, const double* b, std::size_t n) {
  double s[4] = {};
  std::size_t k = 0;
  for (; k + 4 <= n; k += 4)
    for (int lane = 0; lane < 4; ++lane) s[lane] += a[k + lane] * b[k + lane];
  for (; k < n; ++k) s[0] += a[k] * b[k];
  return (s[0] + s[1]) + (s[2] + s[3]);
}

}  // namespace

Skyline::Skyline(std::size_t knots, std::size_t entries)
    : values_(entries + 8), diagonal_(3 * knots), start_(3 * knots + 1), first_(3 * knots) {}

std::size_t Skyline::entriesOf(const std::uint32_t* first, std::size_t knots) {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < knots; ++i) sum += 9 * (i - first[i]) + 3;
  return sum;
}

bool Skyline::shape(const std::uint32_t* first, std::size_t knots) {
  rows_ = 0;
  if (3 * knots > diagonal_.size() || entriesOf(first, knots) + 8 > values_.size()) return false;
  rows_ = 3 * knots;
  std::size_t at = 0;
  for (std::size_t r = 0; r < rows_; ++r) {
    start_[r] = at;
    first_[r] = 3 * first[r / 3];
    at += r - first_[r];
  }
  start_[rows_] = at;
  clear();
  return true;
}

void Skyline::clear() {
  std::fill_n(values_.begin(), start_[rows_], 0.0);
  std::fill_n(diagonal_.begin(), rows_, 0.0);
}

void Skyline::add(std::size_t i, std::size_t j, const Eigen::Matrix3d& block) {
  for (int a = 0; a < 3; ++a) {
    double* const to = row(3 * i + a);
    if (i == j) {
      for (int b = 0; b < a; ++b) to[3 * i + b] += block(a, b);
      diagonal_[3 * i + a] += block(a, a);
    } else {
      for (int b = 0; b < 3; ++b) to[3 * j + b] += block(a, b);
    }
  }
}

bool Skyline::factor() {
  for (std::size_t i = 0; i < rows_; ++i) {
    double* const li = row(i);
    for (std::size_t j = first_[i]; j < i; ++j) {
      const std::size_t k = std::max(first_[i], first_[j]);
      li[j] -= dot(li + k, row(j) + k, j - k);
    }
    double d = diagonal_[i];
    for (std::size_t j = first_[i]; j < i; ++j) {
      const double w = li[j];
      li[j] = w / diagonal_[j];
      d -= w * li[j];
    }
    if (!(d > 0.0)) return false;
    diagonal_[i] = d;
  }
  return true;
}

void Skyline::solve(double* b) const {
  for (std::size_t i = 0; i < rows_; ++i) b[i] -= dot(row(i) + first_[i], b + first_[i], i - first_[i]);
  for (std::size_t i = 0; i < rows_; ++i) b[i] /= diagonal_[i];
  for (std::size_t i = rows_; i-- > 0;) {
    const double* const li = row(i);
    const double x = b[i];
    for (std::size_t j = first_[i]; j < i; ++j) b[j] -= li[j] * x;
  }
}

}  // namespace vest::solver

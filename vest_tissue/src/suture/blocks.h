#pragma once

#include "vest_tissue/suture/block_chain.h"

/// Products of 6×6 blocks whose zeros are known, two numbers at a time: any processor gives the same bits.
namespace vest::suture {

using Matrix63 = Eigen::Matrix<double, 6, 3>;

/// Two numbers of a column; GCC's and Clang's vectors.
using Pair = double __attribute__((vector_size(16), may_alias));

inline const Pair* column(const Matrix6& m, int j) {
  return reinterpret_cast<const Pair*>(m.data() + 6 * j);
}
inline Pair* column(Matrix6& m, int j) {
  return reinterpret_cast<Pair*>(m.data() + 6 * j);
}
inline Pair both(double x) {
  return Pair{x, x};
}
inline double dot(const Pair* a, const Pair* b) {
  const Pair sum = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return sum[0] + sum[1];
}

/// p −= b·bᵀ, lower triangle at least; b has no block in the lower left.
inline void subtractSquare(const Matrix6& b, Matrix6& p) {
  for (int j = 0; j < 6; ++j) {
    Pair* to = column(p, j);
    const int first = j < 2 ? 0 : j < 4 ? 1 : 2;
    for (int k = j < 3 ? 0 : 3; k < 6; ++k) {
      const Pair w = both(b(j, k));
      for (int r = first; r < (k < 3 ? 2 : 3); ++r) to[r] -= column(b, k)[r] * w;
    }
  }
}

/// out = a·rᵀ; a has no block in the lower left, r is lower triangular.
inline void timesUpper(const Matrix6& a, const Matrix6& r, Matrix6& out) {
  for (int j = 0; j < 6; ++j) {
    Pair s[3] = {};
    for (int k = 0; k <= j; ++k) {
      const Pair w = both(r(j, k));
      for (int n = 0; n < (k < 3 ? 2 : 3); ++n) s[n] += column(a, k)[n] * w;
    }
    for (int n = 0; n < 3; ++n) column(out, j)[n] = s[n];
  }
}

/// out = b·r; likewise.
inline void timesLower(const Matrix6& b, const Matrix6& r, Matrix6& out) {
  for (int j = 0; j < 6; ++j) {
    Pair s[3] = {};
    for (int k = j; k < 6; ++k) {
      const Pair w = both(r(k, j));
      for (int n = 0; n < (k < 3 ? 2 : 3); ++n) s[n] += column(b, k)[n] * w;
    }
    for (int n = 0; n < 3; ++n) column(out, j)[n] = s[n];
  }
}

/// out = rᵀ·r.
inline void squareOf(const Matrix6& r, Matrix6& out) {
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i <= j; ++i) out(i, j) = out(j, i) = dot(column(r, i), column(r, j));
}

/// out += fᵀ·m·f, m symmetric.
inline void addBetween(const Matrix6& f, const Matrix6& m, Matrix6& out) {
  Matrix6 h;
  for (int j = 0; j < 6; ++j) {
    Pair s[3] = {};
    for (int k = 0; k < 6; ++k) {
      const Pair w = both(f(k, j));
      for (int n = 0; n < 3; ++n) s[n] += column(m, k)[n] * w;
    }
    for (int n = 0; n < 3; ++n) column(h, j)[n] = s[n];
  }
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i <= j; ++i) {
      out(i, j) += dot(column(f, i), column(h, j));
      out(j, i) = out(i, j);
    }
  }
}

/// out = −fᵀ·m
inline void minusTransposedTimes(const Matrix6& f, const Matrix6& m, Matrix6& out) {
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) out(i, j) = -dot(column(f, i), column(m, j));
}

/// out = a·x
inline void times(const Matrix6& a, const Matrix63& x, Matrix63& out) {
  for (int j = 0; j < 3; ++j) {
    Pair s[3] = {};
    for (int k = 0; k < 6; ++k) {
      const Pair w = both(x(k, j));
      for (int n = 0; n < 3; ++n) s[n] += column(a, k)[n] * w;
    }
    for (int n = 0; n < 3; ++n) reinterpret_cast<Pair*>(out.data() + 6 * j)[n] = s[n];
  }
}

}  // namespace vest::suture

#include "vest_tissue/fem/condensed.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <stdexcept>

#include "vest_tissue/fem/cache.h"

namespace vest::fem {
namespace {

constexpr std::size_t kFaces[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

/// Per element and face (opposite corner 0 … 3) the element behind it; kNoSlot: the surface.
std::vector<std::array<std::uint32_t, 4>> findNeighbours(const Description& d) {
  std::map<std::array<Index, 3>, std::pair<std::uint32_t, std::size_t>> open;
  std::vector<std::array<std::uint32_t, 4>> neighbour(d.tetrahedra.size(),
                                                      {kNoSlot, kNoSlot, kNoSlot, kNoSlot});
  for (std::uint32_t e = 0; e < d.tetrahedra.size(); ++e) {
    for (std::size_t f = 0; f < 4; ++f) {
      const auto& t = d.tetrahedra[e];
      std::array<Index, 3> key{t[kFaces[f][0]], t[kFaces[f][1]], t[kFaces[f][2]]};
      std::sort(key.begin(), key.end());
      const auto found = open.find(key);
      if (found == open.end()) {
        open[key] = {e, f};
        continue;
      }
      neighbour[e][f] = found->second.first;
      neighbour[found->second.first][found->second.second] = e;
      open.erase(found);
    }
  }
  return neighbour;
}

Description smallStrain(Description d) {
  d.strain = Strain::Small;
  return d;
}

/// u[i] += sum_k column_k[i]·f_k for the first `rows` rows, six columns at a time: u is loaded and stored a
/// sixth as often. Element by element, without reductions: the same bits at any vector width.
inline __attribute__((always_inline)) void addColumnsBody(const double* data, std::size_t stride,
                                                          std::size_t rows, const std::uint32_t* column,
                                                          const double* f, std::size_t count,
                                                          double* __restrict u) {
  std::size_t k = 0;
  for (; k + 6 <= count; k += 6) {
    const double *c0 = data + stride * column[k], *c1 = data + stride * column[k + 1],
                 *c2 = data + stride * column[k + 2], *c3 = data + stride * column[k + 3],
                 *c4 = data + stride * column[k + 4], *c5 = data + stride * column[k + 5];
    const double f0 = f[k], f1 = f[k + 1], f2 = f[k + 2], f3 = f[k + 3], f4 = f[k + 4], f5 = f[k + 5];
    for (std::size_t i = 0; i < rows; ++i) {
      u[i] += ((c0[i] * f0 + c1[i] * f1) + (c2[i] * f2 + c3[i] * f3)) + (c4[i] * f4 + c5[i] * f5);
    }
  }
  for (; k < count; ++k) {
    const double* c = data + stride * column[k];
    for (std::size_t i = 0; i < rows; ++i) u[i] += c[i] * f[k];
  }
}

using AddColumns = void (*)(const double*, std::size_t, std::size_t, const std::uint32_t*, const double*,
                            std::size_t, double*);

void addColumnsBaseline(const double* data, std::size_t stride, std::size_t rows, const std::uint32_t* column,
                        const double* f, std::size_t count, double* u) {
  addColumnsBody(data, stride, rows, column, f, count, u);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) void addColumnsAvx2(const double* data, std::size_t stride, std::size_t rows,
                                                    const std::uint32_t* column, const double* f,
                                                    std::size_t count, double* u) {
  addColumnsBody(data, stride, rows, column, f, count, u);
}
#endif

/// By processor, or what VEST_KERNEL says (baseline, avx2), as the net's kernels.
AddColumns chooseAddColumns() {
#if defined(__x86_64__)
  const char* wanted = std::getenv("VEST_KERNEL");
  const bool any = wanted == nullptr || *wanted == '\0';
  if (__builtin_cpu_supports("avx2") && (any || std::strcmp(wanted, "avx2") == 0)) return addColumnsAvx2;
#endif
  return addColumnsBaseline;
}

const AddColumns addColumns = chooseAddColumns();

}  // namespace

CondensedModel::CondensedModel(const Description& description, const CondensedOptions& options)
    : model_(buildModel(smallStrain(description), Use::Static)), most_rank_(std::max(0, options.most_rank)) {
  const Description& d = model_->description;
  neighbours_ = findNeighbours(d);
  std::vector<std::uint8_t> surface(d.nodes.size(), 0);
  for (std::size_t e = 0; e < neighbours_.size(); ++e) {
    for (std::size_t f = 0; f < 4; ++f) {
      if (neighbours_[e][f] != kNoSlot) continue;
      for (std::size_t k : kFaces[f]) surface[d.tetrahedra[e][k]] = 1;
    }
  }
  std::vector<std::uint8_t> deep = surface;
  for (const auto& t : d.tetrahedra) {
    if (options.outer == Outer::Surface) break;
    const bool touches = std::any_of(t.begin(), t.end(), [&](Index n) { return surface[n] != 0; });
    for (Index n : t) deep[n] = deep[n] != 0 || touches || options.outer == Outer::All ? 1 : 0;
  }
  outer_number_.assign(d.nodes.size(), -1);
  for (const bool first : {true, false}) {
    for (const Index n : model_->free_node) {
      if (deep[n] == 0 || (surface[n] != 0) != first) continue;
      outer_number_[n] = static_cast<std::int32_t>(outer_node_.size());
      outer_node_.push_back(n);
    }
    if (first) surface_unknowns_ = 3 * static_cast<Eigen::Index>(outer_node_.size());
  }
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(outer_node_.size());
  const std::uint64_t hash = contentHash(d, outer_node_);
  if (!options.cache_directory.empty() && loadMatrix(options.cache_directory, hash, size, inverse_)) {
    from_cache_ = true;
    return;
  }
  inverse_.resize(size, size);
  constexpr Eigen::Index kBatch = 48;
  Eigen::MatrixXd columns;
  for (Eigen::Index first = 0; first < size; first += kBatch) {
    const Eigen::Index count = std::min(kBatch, size - first);
    columns.setZero(3 * static_cast<Eigen::Index>(model_->free_node.size()), count);
    for (Eigen::Index c = 0; c < count; ++c) {
      const Index node = outer_node_[static_cast<std::size_t>((first + c) / 3)];
      columns(3 * model_->unknown[node] + (first + c) % 3, c) = 1.0;
    }
    solveFull(columns);
    for (Eigen::Index c = 0; c < count; ++c) {
      for (std::size_t o = 0; o < outer_node_.size(); ++o) {
        inverse_.col(first + c).segment<3>(3 * static_cast<Eigen::Index>(o)) =
            columns.col(c).segment<3>(3 * model_->unknown[outer_node_[o]]);
      }
    }
  }
  // Symmetric up to rounding; exactly from here on.
  for (Eigen::Index j = 0; j < size; ++j) {
    for (Eigen::Index i = j + 1; i < size; ++i) {
      inverse_(i, j) = inverse_(j, i) = 0.5 * (inverse_(i, j) + inverse_(j, i));
    }
  }
  if (!options.cache_directory.empty()) saveMatrix(options.cache_directory, hash, inverse_);
}

void CondensedModel::solveFull(Eigen::MatrixXd& columns) const {
  std::lock_guard<std::mutex> lock(mutex_);
  if (!factor_) {
    Scratch scratch(*model_, 1);
    const State rest = restState(*model_);
    assemble(*model_, rest, 0.0, 1.0, Tangent::Frozen, scratch);
    if (!scratch.matrix.factorise()) {
      throw std::invalid_argument(
          "object '" + description().name +
          "': its stiffness is singular to rounding; allowed: supports that hold every part, "
          "no slivers");
    }
    factor_ = std::make_unique<BlockLdlt>(std::move(scratch.matrix));
  }
  factor_->solveColumns(columns.data(), static_cast<std::size_t>(columns.cols()),
                        static_cast<std::size_t>(columns.rows()));
}

CondensedState::CondensedState(const CondensedModel& m)
    : alive(m.model().elements.size(), 1),
      loose(m.description().nodes.size(), 0),
      grounded(m.description().nodes.size(), 0),
      outer_columns(m.unknowns(), m.mostRank()),
      core(m.mostRank(), m.mostRank()) {
  columns.reserve(static_cast<std::size_t>(m.mostRank()));
}

CondensedScratch::CondensedScratch(const CondensedModel& m) : small(m.mostRank()), small2(m.mostRank()) {}

void addResponse(const CondensedModel& model, const CondensedState& state, const SparseLoad& load,
                 CondensedScratch& scratch, Eigen::VectorXd& u) {
  addColumns(model.inverse().data(), static_cast<std::size_t>(model.unknowns()),
             static_cast<std::size_t>(u.size()), load.unknown.data(), load.force.data(), load.unknown.size(),
             u.data());
  const Eigen::Index r = static_cast<Eigen::Index>(state.columns.size());
  if (r == 0) return;
  // u -= T core T^T f
  for (Eigen::Index c = 0; c < r; ++c) {
    double sum = 0.0;
    for (std::size_t k = 0; k < load.unknown.size(); ++k)
      sum += state.outer_columns(load.unknown[k], c) * load.force[k];
    scratch.small[c] = sum;
  }
  for (Eigen::Index c = 0; c < r; ++c) {
    double sum = 0.0;
    for (Eigen::Index k = 0; k < r; ++k) sum += state.core(k, c) * scratch.small[k];
    scratch.small2[c] = -sum;
  }
  for (Eigen::Index c = 0; c < r; ++c) u += scratch.small2[c] * state.outer_columns.col(c).head(u.size());
}

Eigen::Matrix3d complianceBlock(const CondensedModel& model, const CondensedState& state, std::uint32_t a,
                                std::uint32_t b) {
  Eigen::Matrix3d C = model.inverse().block<3, 3>(3 * a, 3 * b);
  const Eigen::Index r = static_cast<Eigen::Index>(state.columns.size());
  for (Eigen::Index i = 0; i < r; ++i) {
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (Eigen::Index k = 0; k < r; ++k)
      right += state.core(k, i) * state.outer_columns.col(k).segment<3>(3 * b);
    C -= state.outer_columns.col(i).segment<3>(3 * a) * right.transpose();
  }
  return C;
}

bool prescribe(const CondensedModel& model, const CondensedState& state, const std::vector<double>& target,
               const Eigen::VectorXd& u, CondensedScratch&, SparseLoad& load) {
  constexpr std::size_t kMost = 128;
  const std::size_t n = load.unknown.size();
  if (n == 0 || n > kMost || target.size() != n) return false;
  const Eigen::Index r = static_cast<Eigen::Index>(state.columns.size());
  double L[kMost][kMost];  // 128 kB of stack instead of an allocation
  double x[kMost];
  const auto entry = [&](std::uint32_t p, std::uint32_t q) {
    double c = model.inverse()(p, q);
    for (Eigen::Index i = 0; i < r; ++i) {
      double right = 0.0;
      for (Eigen::Index k = 0; k < r; ++k) right += state.core(k, i) * state.outer_columns(q, k);
      c -= state.outer_columns(p, i) * right;
    }
    return c;
  };
  for (std::size_t i = 0; i < n; ++i) {
    if (state.loose[model.outerNodes()[load.unknown[i] / 3]] != 0) return false;
    for (std::size_t j = 0; j <= i; ++j) L[i][j] = entry(load.unknown[i], load.unknown[j]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double before = L[i][i];
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = L[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
      if (j < i) {
        L[i][j] = sum / L[j][j];
      } else {
        if (!(sum > 1e-13 * before)) return false;
        L[i][i] = std::sqrt(sum);
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = target[i] - u[load.unknown[i]];
    for (std::size_t k = 0; k < i; ++k) x[i] -= L[i][k] * x[k];
    x[i] /= L[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= L[k][i] * x[k];
    x[i] /= L[i][i];
  }
  load.force.resize(n);
  std::copy(x, x + n, load.force.begin());
  return true;
}

std::vector<Eigen::Vector3d> fullField(const CondensedModel& model, const SparseLoad& load) {
  const Model& m = model.model();
  Eigen::MatrixXd column = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(m.free_node.size()), 1);
  for (std::size_t k = 0; k < load.unknown.size(); ++k) {
    const Index node = model.outerNodes()[load.unknown[k] / 3];
    column(3 * m.unknown[node] + load.unknown[k] % 3, 0) += load.force[k];
  }
  model.solveFull(column);
  std::vector<Eigen::Vector3d> u(m.mass.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < m.free_node.size(); ++i) {
    u[m.free_node[i]] = column.col(0).segment<3>(3 * static_cast<Eigen::Index>(i));
  }
  return u;
}

}  // namespace vest::fem

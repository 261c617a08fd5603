#include "condense.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "product.h"
#include "vest_tissue/fem/element.h"
#include "vest_tissue/fem/model.h"

namespace vest::fem {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kLeaf = 64;   // nodes that are not divided further (tuned)
constexpr std::size_t kPanel = 48;  // columns that are factorised at a time (tuned)
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// Nodes that are eliminated together, once what hangs on them alone has been.
struct Part {
  std::uint32_t first = 0, end = 0;  // places in the order of elimination
  std::size_t left = kNone, right = kNone;
};

/// What eliminating a part leaves to the one above: columns of inner nodes, rows of all.
struct Update {
  std::vector<std::uint32_t> rows;  // numbers, ascending
  std::size_t inner = 0;            // of them, which come first
  std::vector<double> numbers;      // by columns, 3·rows high
};

/// Numbers: inner nodes as they are eliminated, then outer ones, then two that stand for the right sides:
/// their rows are f (gravity along x, y, z; the scene's loads). What happens to rows of K happens to them.
class Condensing {
 public:
  Condensing(const Description& d, const std::vector<Index>& outer)
      : d_(d), outer_(outer.size()), number_(d.nodes.size(), kNone) {
    std::vector<std::uint8_t> held(d.nodes.size(), 0);
    for (const Index n : d.fixed) held[n] = 1;
    for (const Index n : outer) held[n] = 1;
    std::vector<Index> inside;
    for (Index n = 0; n < d.nodes.size(); ++n)
      if (held[n] == 0) inside.push_back(n);
    inner_ = inside.size();
    findNeighbours(inside);
    divide(inside);
    std::size_t next = inner_;
    for (const Index n : outer) number_[n] = next++;
  }

  Condensed run(const Progress& progress) {
    Condensed out(outer_ + 2);
    kept_ = &out.stiffness;
    assemble();
    std::vector<Update> waiting(parts_.size());
    place_.assign(inner_ + outer_ + 2, 0);
    mark_.assign(place_.size(), 0);
    for (std::size_t p = 0; p < parts_.size(); ++p) {
      eliminate(parts_[p], waiting, waiting[p]);
      if (progress) progress(static_cast<double>(parts_[p].end) / static_cast<double>(inner_));
    }
    takeLoads(out);
    return out;
  }

 private:
  void findNeighbours(const std::vector<Index>& inside) {
    neighbours_.resize(d_.nodes.size());
    std::vector<std::uint8_t> is(d_.nodes.size(), 0);
    for (const Index n : inside) is[n] = 1;
    for (const auto& t : d_.tetrahedra)
      for (const Index a : t)
        for (const Index b : t)
          if (a != b && is[a] != 0 && is[b] != 0) neighbours_[a].push_back(b);
    for (auto& list : neighbours_) {
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    side_.assign(d_.nodes.size(), 0);
  }

  /// Halves along the longest side of what they fill; the nodes of one half that touch the other part both.
  /// @return its part, or kNone
  std::size_t divide(std::vector<Index>& nodes) {
    if (nodes.empty()) return kNone;
    Part part;
    std::vector<Index> own;
    if (nodes.size() <= kLeaf) {
      own = nodes;
    } else {
      Vector3d low = d_.nodes[nodes[0]], high = low;
      for (const Index n : nodes) low = low.cwiseMin(d_.nodes[n]), high = high.cwiseMax(d_.nodes[n]);
      Eigen::Index axis = 0;
      (high - low).maxCoeff(&axis);
      std::sort(nodes.begin(), nodes.end(), [&](Index a, Index b) {
        const double xa = d_.nodes[a][axis], xb = d_.nodes[b][axis];
        return xa != xb ? xa < xb : a < b;
      });
      for (std::size_t i = 0; i < nodes.size(); ++i) side_[nodes[i]] = i < nodes.size() / 2 ? 1 : 2;
      std::array<std::vector<Index>, 2> border, rest;
      for (const Index n : nodes) {
        const std::uint8_t side = side_[n];
        const auto across = [&](Index m) { return side_[m] != 0 && side_[m] != side; };
        const bool touches = std::any_of(neighbours_[n].begin(), neighbours_[n].end(), across);
        (touches ? border : rest)[side - 1u].push_back(n);
      }
      for (const Index n : nodes) side_[n] = 0;
      const std::size_t parting = border[0].size() <= border[1].size() ? 0 : 1;
      auto& whole = rest[1 - parting];
      whole.insert(whole.end(), border[1 - parting].begin(), border[1 - parting].end());
      own = border[parting];
      nodes.clear(), nodes.shrink_to_fit();
      part.left = divide(rest[0]);
      part.right = divide(rest[1]);
    }
    part.first = next_;
    for (const Index n : own) number_[n] = next_++;
    part.end = next_;
    parts_.push_back(part);
    return parts_.size() - 1;
  }

  /// Columns of inner nodes: blocks of the rows from the diagonal on. Those of outer nodes go where they
  /// stay.
  void assemble() {
    columns_.resize(inner_);
    const auto right = static_cast<std::uint32_t>(inner_ + outer_);
    const auto add = [&](std::size_t row, std::size_t column, const Matrix3d& block) {
      if (row < column) return add_(column, row, block.transpose());
      add_(row, column, block);
    };
    for (const Load& l : d_.loads) {
      if (number_[l.node] == kNone) continue;
      Matrix3d block = Matrix3d::Zero();
      block.row(0) = l.force.transpose();
      add(right + 1, number_[l.node], block);
    }
    for (std::size_t e = 0; e < d_.tetrahedra.size(); ++e) {
      const auto& t = d_.tetrahedra[e];
      const Element element =
          makeElement(t, {d_.nodes[t[0]], d_.nodes[t[1]], d_.nodes[t[2]], d_.nodes[t[3]]});
      const Material& material = d_.materialOf(e);
      const Lame law = lame(material);
      for (const auto& pair : kPairs) {
        const std::size_t a = number_[t[static_cast<std::size_t>(pair[0])]],
                          b = number_[t[static_cast<std::size_t>(pair[1])]];
        if (a == kNone || b == kNone) continue;
        add(a, b, stiffnessBlock(element, law, Matrix3d::Identity(), pair[0], pair[1]));
        if (a == b) add(right, a, 0.25 * material.density * element.volume * Matrix3d::Identity());
      }
    }
    for (auto& column : columns_)
      std::sort(column.begin(), column.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  void add_(std::size_t row, std::size_t column, const Matrix3d& block) {
    if (column >= inner_) return keep(row - inner_, column - inner_, block);
    auto& entries = columns_[column];
    const auto at = static_cast<std::uint32_t>(row);
    const auto found =
        std::find_if(entries.begin(), entries.end(), [&](const auto& entry) { return entry.first == at; });
    if (found == entries.end())
      entries.emplace_back(at, block);
    else
      found->second += block;
  }
  /// Into what stays; row >= column.
  void keep(std::size_t row, std::size_t column, const Matrix3d& block) {
    for (std::size_t b = 0; b < 3; ++b) {
      for (std::size_t a = 0; a < 3; ++a) {
        const double number = block(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
        kept_->at(3 * row + a, 3 * column + b) += number;
        if (row != column && row / Compliance::kTile == column / Compliance::kTile)
          kept_->at(3 * column + b, 3 * row + a) += number;  // that tile is whole
      }
    }
  }

  std::vector<std::uint32_t> rowsOf(const Part& part, const std::vector<Update>& waiting) {
    std::vector<std::uint32_t> rows;
    ++marks_;
    const auto take = [&](std::uint32_t row) {
      if (mark_[row] == marks_) return;
      mark_[row] = marks_;
      rows.push_back(row);
    };
    for (std::uint32_t n = part.first; n < part.end; ++n) {
      take(n);
      for (const auto& entry : columns_[n]) take(entry.first);
    }
    for (const std::size_t child : {part.left, part.right})
      if (child != kNone)
        for (const std::uint32_t row : waiting[child].rows) take(row);
    std::sort(rows.begin(), rows.end());
    for (std::size_t i = 0; i < rows.size(); ++i) place_[rows[i]] = static_cast<std::uint32_t>(i);
    return rows;
  }

  void eliminate(const Part& part, std::vector<Update>& waiting, Update& left) {
    std::vector<std::uint32_t> rows = rowsOf(part, waiting);
    const std::size_t own = part.end - part.first, height = 3 * rows.size();
    const std::size_t inner =
        static_cast<std::size_t>(std::lower_bound(rows.begin(), rows.end(), inner_) - rows.begin());
    std::vector<double> front(height * 3 * inner, 0.0);
    for (std::uint32_t n = part.first; n < part.end; ++n) {
      double* const column = front.data() + 3 * height * place_[n];
      for (const auto& [row, block] : columns_[n])
        for (std::size_t b = 0; b < 3; ++b)
          for (std::size_t a = 0; a < 3; ++a)
            column[b * height + 3 * place_[row] + a] =
                block(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
      columns_[n].clear(), columns_[n].shrink_to_fit();
    }
    for (const std::size_t child : {part.left, part.right}) {
      if (child == kNone) continue;
      takeUpdate(waiting[child], height, front.data());
      waiting[child] = Update{};
    }
    factorise(front.data(), height, 3 * own, 3 * inner);
    keepOuter(front.data(), height, 3 * own, inner, rows);
    left.inner = inner - own;
    left.rows.assign(rows.begin() + static_cast<std::ptrdiff_t>(own), rows.end());
    const std::size_t below = 3 * left.rows.size();
    left.numbers.resize(below * 3 * left.inner);
    for (std::size_t j = 0; j < 3 * left.inner; ++j)
      std::copy_n(front.data() + (3 * own + j) * height + 3 * own, below, left.numbers.data() + j * below);
  }

  void takeUpdate(const Update& from, std::size_t height, double* front) const {
    const std::size_t below = 3 * from.rows.size();
    for (std::size_t j = 0; j < 3 * from.inner; ++j) {
      const double* const column = from.numbers.data() + j * below;
      double* const to = front + (3 * place_[from.rows[j / 3]] + j % 3) * height;
      for (std::size_t i = j / 3; i < from.rows.size(); ++i)
        for (std::size_t a = 0; a < 3; ++a) to[3 * place_[from.rows[i]] + a] += column[3 * i + a];
    }
  }

  /// The first `own` of `columns` columns, Cholesky; the other ones less what these explain. Lower part.
  void factorise(double* f, std::size_t height, std::size_t own, std::size_t columns) const {
    for (std::size_t k = 0; k < own; k += kPanel) {
      const std::size_t end = std::min(k + kPanel, own);
      for (std::size_t j = k; j < end; ++j) {
        double* const column = f + j * height;
        for (std::size_t p = k; p < j; ++p) {
          const double* const before = f + p * height;
          const double factor = before[j];
          for (std::size_t i = j; i < height; ++i) column[i] -= factor * before[i];
        }
        if (!(column[j] > 0.0)) {
          throw std::invalid_argument(
              "object '" + d_.name +
              "': its stiffness is singular to rounding; allowed: supports that hold every part, no slivers");
        }
        const double root = std::sqrt(column[j]);
        for (std::size_t i = j; i < height; ++i) column[i] /= root;
      }
      for (std::size_t j = end; j < columns; j += Tiles::kWide) {
        const std::size_t width = std::min(Tiles::kWide, columns - j);
        subtract({f + j * height + j, f + k * height + j, f + k * height + j, height, height, height,
                  height - j, width, end - k});
      }
    }
  }

  /// Between outer nodes all goes where it stays.
  void keepOuter(const double* f, std::size_t height, std::size_t own, std::size_t inner,
                 const std::vector<std::uint32_t>& rows) {
    constexpr std::size_t kNodes = Compliance::kTile, kWide = Tiles::kWide;
    std::vector<double> part(kWide * kWide);
    for (std::size_t i = inner; i < rows.size(); i += kNodes) {
      const std::size_t high = std::min(kNodes, rows.size() - i);
      for (std::size_t j = inner; j <= i; j += kNodes) {
        const std::size_t wide = std::min(kNodes, rows.size() - j);
        std::fill(part.begin(), part.end(), 0.0);
        subtract({part.data(), f + 3 * i, f + 3 * j, kWide, height, height, 3 * high, 3 * wide, own});
        for (std::size_t b = 0; b < wide; ++b)
          for (std::size_t a = i == j ? b : 0; a < high; ++a)
            keep(rows[i + a] - inner_, rows[j + b] - inner_,
                 Eigen::Map<const Matrix3d, 0, Eigen::OuterStride<>>(part.data() + 3 * b * kWide + 3 * a,
                                                                     Eigen::OuterStride<>(kWide)));
      }
    }
  }

  /// The rows that stand for right sides are taken out; 1 on their diagonal, and where a tile has no node.
  void takeLoads(Condensed& out) const {
    const std::size_t first = 3 * outer_, size = Tiles::kWide * out.stiffness.count();
    Tiles& s = out.stiffness;
    const auto row = [first](std::size_t i) { return first + i; };
    out.loads.resize(static_cast<Eigen::Index>(first), 4);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t n = 0; n < first; ++n)
        out.loads(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(i)) = s.at(row(i), n);
      for (std::size_t j = 0; j <= i; ++j)
        out.inner(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
            out.inner(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = s.at(row(i), row(j));
    }
    for (std::size_t i = first; i < size; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        s.at(i, j) = 0.0;
        if (i / Tiles::kWide == j / Tiles::kWide) s.at(j, i) = 0.0;
      }
      s.at(i, i) = 1.0;
    }
  }

  const Description& d_;
  std::size_t outer_ = 0, inner_ = 0;
  std::uint32_t next_ = 0;
  std::vector<std::size_t> number_;  // per node; kNone: held
  std::vector<std::vector<Index>> neighbours_;
  std::vector<std::uint8_t> side_;
  std::vector<Part> parts_;
  std::vector<std::vector<std::pair<std::uint32_t, Matrix3d>>> columns_;  // per inner node
  Tiles* kept_ = nullptr;
  std::vector<std::uint32_t> place_, mark_;
  std::uint32_t marks_ = 0;
};

}  // namespace

Condensed condense(const Description& description, const std::vector<Index>& outer,
                   const Progress& progress) {
  return Condensing(description, outer).run(progress);
}

}  // namespace vest::fem

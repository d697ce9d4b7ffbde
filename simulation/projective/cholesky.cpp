#include "simulation/projective/cholesky.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr int kHalvings = 5;       ///< 32 parts that are solved in parallel
constexpr int kSmallestPart = 48;  ///< unknowns; smaller ones are not halved

/// A part of the unknowns: its halves and what joins them.
struct Dissection {
  const Eigen::SparseMatrix<double>& matrix;
  const Points& positions;
  std::vector<int> order;
  std::vector<int> side;  ///< of each unknown in the part that is being halved
  struct Part {
    int depth, begin, end, separator;  ///< of the order; the separator begins there
  };
  std::vector<Part> parts;

  void dissect(std::vector<int> unknowns, int depth) {
    const int begin = static_cast<int>(order.size());
    if (static_cast<int>(unknowns.size()) < kSmallestPart) {
      order.insert(order.end(), unknowns.begin(), unknowns.end());
      parts.push_back({depth, begin, static_cast<int>(order.size()), begin});
      return;
    }
    Eigen::RowVector3d low = positions.row(unknowns[0]);
    Eigen::RowVector3d high = low;
    for (int u : unknowns) {
      low = low.cwiseMin(positions.row(u));
      high = high.cwiseMax(positions.row(u));
    }
    Index axis = 0;
    (high - low).maxCoeff(&axis);
    const auto before = [&](int a, int b) {
      const double pa = positions(a, axis);
      const double pb = positions(b, axis);
      return pa != pb ? pa < pb : a < b;
    };
    const auto middle = unknowns.begin() + static_cast<std::ptrdiff_t>(unknowns.size() / 2);
    std::nth_element(unknowns.begin(), middle, unknowns.end(), before);
    for (auto u = unknowns.begin(); u != unknowns.end(); ++u) {
      side[*u] = u < middle ? 1 : 2;
    }
    std::vector<int> parts_of[3];
    for (int u : unknowns) {
      bool joins = false;
      for (Eigen::SparseMatrix<double>::InnerIterator it(matrix, u); it; ++it) {
        joins = joins || (side[u] == 2 && side[it.row()] == 1);
      }
      parts_of[joins ? 2 : side[u] - 1].push_back(u);
    }
    for (int u : unknowns) {
      side[u] = 0;
    }
    // Each part in the order of its numbers: neighbours in the cloth stay neighbours in memory.
    for (std::vector<int>& part : parts_of) {
      std::sort(part.begin(), part.end());
    }
    unknowns.clear();
    dissect(std::move(parts_of[0]), depth + 1);
    dissect(std::move(parts_of[1]), depth + 1);
    const int separator = static_cast<int>(order.size());
    order.insert(order.end(), parts_of[2].begin(), parts_of[2].end());
    parts.push_back({depth, begin, static_cast<int>(order.size()), separator});
  }
};

}  // namespace

CholeskyFactor::CholeskyFactor(const Eigen::SparseMatrix<double>& matrix, const Points& positions) {
  const int n = static_cast<int>(matrix.rows());
  row_begin_ = column_begin_ = {0};
  if (n == 0) {
    return;
  }
  Dissection dissection{
      matrix, positions, {}, std::vector<int>(static_cast<std::size_t>(n), 0), {}};
  std::vector<int> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  dissection.dissect(std::move(all), 0);
  order_ = std::move(dissection.order);
  levels_.resize(kHalvings + 1);
  for (const Dissection::Part& part : dissection.parts) {
    const bool leaf = part.separator == part.begin && part.depth < kHalvings;
    if (part.depth == kHalvings || leaf) {
      levels_[0].push_back({part.begin, part.end});
    } else if (part.depth < kHalvings) {
      levels_[static_cast<std::size_t>(kHalvings - part.depth)].push_back(
          {part.separator, part.end});
    }
  }
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation(n);
  for (int i = 0; i < n; ++i) {
    permutation.indices()[order_[i]] = i;
  }
  Eigen::SparseMatrix<double> permuted(n, n);
  permuted.selfadjointView<Eigen::Lower>() =
      matrix.selfadjointView<Eigen::Lower>().twistedBy(permutation);
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>
      factor(permuted);
  if (factor.info() != Eigen::Success) {
    throw DataError("", "material", "a matrix M + h^2 K that is not positive definite",
                    "stiffnesses and masses within double precision of each other, or a smaller "
                    "time step");
  }
  const Eigen::SparseMatrix<double> lower = factor.matrixL();
  const Eigen::SparseMatrix<double, Eigen::RowMajor> by_rows = lower;
  inverse_diagonal_.resize(static_cast<std::size_t>(n));
  const auto copy = [&](const auto& from, std::vector<int>& begin, std::vector<int>& index,
                        std::vector<double>& values) {
    for (int outer = 0; outer < n; ++outer) {
      for (typename std::decay_t<decltype(from)>::InnerIterator it(from, outer); it; ++it) {
        if (it.row() == it.col()) {
          inverse_diagonal_[outer] = 1 / it.value();
        } else {
          index.push_back(static_cast<int>(it.index()));
          values.push_back(it.value());
        }
      }
      begin.push_back(static_cast<int>(index.size()));
    }
  };
  copy(by_rows, row_begin_, row_index_, row_values_);
  copy(lower, column_begin_, column_index_, column_values_);
}

namespace {

/// Subtracts from an unknown what entries [first, last) of its row or column say, and scales it.
inline void eliminate(const int* index, const double* values, int first, int last, double inverse,
                      Vec4<double>* y, int unknown) {
  double sum[4] = {};
  for (int e = first; e < last; ++e) {
    const double* from = &y[index[e]].x;
    const double value = values[e];
    for (int k = 0; k < 4; ++k) {
      sum[k] += value * from[k];
    }
  }
  double* const to = &y[unknown].x;
  for (int k = 0; k < 4; ++k) {
    to[k] = (to[k] - sum[k]) * inverse;
  }
}

}  // namespace

void CholeskyFactor::solve(std::vector<Vec4<double>>& x) {
  ATELIER_CHECK(x.size() == order_.size(), "right hand sides of another matrix");
  scratch_.resize(order_.size());
  Vec4<double>* const y = scratch_.data();
  const auto for_unknowns = [&](const auto& work) {
    parallel_for(size(), 4096, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        work(i);
      }
    });
  };
  const auto for_blocks = [&](const std::vector<Block>& level, const auto& work) {
    parallel_for(static_cast<Index>(level.size()), 1, [&](Index begin, Index end) {
      for (Index b = begin; b < end; ++b) {
        work(level[b]);
      }
    });
  };
  for_unknowns([&](Index i) { y[i] = x[order_[i]]; });
  for (const std::vector<Block>& level : levels_) {
    for_blocks(level, [&](const Block& block) {
      for (int i = block.begin; i < block.end; ++i) {
        eliminate(row_index_.data(), row_values_.data(), row_begin_[i], row_begin_[i + 1],
                  inverse_diagonal_[i], y, i);
      }
    });
  }
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    for_blocks(*level, [&](const Block& block) {
      for (int i = block.end - 1; i >= block.begin; --i) {
        eliminate(column_index_.data(), column_values_.data(), column_begin_[i],
                  column_begin_[i + 1], inverse_diagonal_[i], y, i);
      }
    });
  }
  for_unknowns([&](Index i) { x[order_[i]] = y[i]; });
}

}  // namespace atelier

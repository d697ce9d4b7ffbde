#include "simulation/projective/inverse_factor.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace atelier {
namespace {

constexpr int kWholePart = 32;  ///< unknowns that are not halved: a warp has a thread for each
constexpr int kColumnsATask = 256;

int rounded_up(int n) {
  return (n + InverseFactor::kAlign - 1) / InverseFactor::kAlign * InverseFactor::kAlign;
}

}  // namespace

InverseFactor::InverseFactor(const Eigen::SparseMatrix<double>& matrix, const Points& positions) {
  const int n = static_cast<int>(matrix.rows());
  if (n == 0) {
    return;
  }
  std::vector<int> side(static_cast<std::size_t>(n), 0);
  std::vector<int> all(static_cast<std::size_t>(n));
  std::iota(all.begin(), all.end(), 0);
  dissect(matrix, positions, std::move(all), side);
  std::int64_t offset = 0;
  for (Part& part : parts_) {
    part.column = part.first / kAlign * kAlign;
    part.stride = rounded_up(part.end - part.column);
    part.offset = offset;
    offset += static_cast<std::int64_t>(part.end - part.begin) * part.stride;
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
  values_.assign(static_cast<std::size_t>(offset), 0.0);
  const Eigen::SparseMatrix<double> lower = factor.matrixL();
  fill(lower);
}

/// Appends the unknowns to the order; returns their part, the last one. Each is halved across the
/// longest axis of its box; what joins the halves comes after them.
int InverseFactor::dissect(const Eigen::SparseMatrix<double>& matrix, const Points& positions,
                           std::vector<int> unknowns, std::vector<int>& side) {
  const int first = static_cast<int>(order_.size());
  const auto append = [&](const std::vector<int>& last, int begin) {
    order_.insert(order_.end(), last.begin(), last.end());
    parts_.push_back({first, begin, static_cast<int>(order_.size()), -1, 0, 0, 0});
    return static_cast<int>(parts_.size()) - 1;
  };
  if (static_cast<int>(unknowns.size()) <= kWholePart) {
    return append(unknowns, first);
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
    return std::pair(positions(a, axis), a) < std::pair(positions(b, axis), b);
  };
  const auto middle = unknowns.begin() + static_cast<std::ptrdiff_t>(unknowns.size() / 2);
  std::nth_element(unknowns.begin(), middle, unknowns.end(), before);
  for (auto u = unknowns.begin(); u != unknowns.end(); ++u) {
    side[*u] = u < middle ? 1 : 2;
  }
  std::vector<int> halves[2];
  std::vector<int> separator;
  for (int u : unknowns) {
    bool joins = false;
    for (Eigen::SparseMatrix<double>::InnerIterator it(matrix, u); it; ++it) {
      joins = joins || (side[u] == 2 && side[it.row()] == 1);
    }
    (joins ? separator : halves[side[u] - 1]).push_back(u);
  }
  for (int u : unknowns) {
    side[u] = 0;
  }
  unknowns.clear();
  int roots[2] = {-1, -1};
  for (int k = 0; k < 2; ++k) {
    std::sort(halves[k].begin(), halves[k].end());
    if (!halves[k].empty()) {
      roots[k] = dissect(matrix, positions, std::move(halves[k]), side);
    }
  }
  std::sort(separator.begin(), separator.end());
  const int own = append(separator, static_cast<int>(order_.size()));
  for (int root : roots) {
    if (root >= 0) {
      parts_[root].parent = own;
    }
  }
  return own;
}

/// Row i of W is (e_i - sum of L_ik times row k over k < i) / L_ii; columns do not depend on each
/// other.
void InverseFactor::fill(const Eigen::SparseMatrix<double, Eigen::RowMajor>& lower) {
  std::vector<int> part_of(order_.size());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    std::fill(part_of.begin() + parts_[p].begin, part_of.begin() + parts_[p].end,
              static_cast<int>(p));
  }
  const auto row_at = [&](int i, int column) {
    const Part& part = parts_[part_of[i]];
    return &values_[static_cast<std::size_t>(part.row(i) + (column - part.column))];
  };
  parallel_for((size() + kColumnsATask - 1) / kColumnsATask, 1, [&](Index task, Index last) {
    const int begin = static_cast<int>(task) * kColumnsATask;
    const int end = std::min(static_cast<int>(last) * kColumnsATask, size());
    for (int i = begin; i < size(); ++i) {
      const int from = std::max(parts_[part_of[i]].first, begin);
      const int to = std::min(i + 1, end);
      if (from >= to) {
        continue;
      }
      double* const row = row_at(i, from);
      double diagonal = 1;
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(lower, i); it; ++it) {
        const int k = static_cast<int>(it.col());
        if (k == i) {
          diagonal = it.value();
          continue;
        }
        const int k_from = std::max(parts_[part_of[k]].first, begin);
        const int count = std::min(k + 1, end) - k_from;
        if (count > 0) {
          const double* const of_k = row_at(k, k_from);
          double* const to_k = row + (k_from - from);
          const double value = it.value();
          for (int c = 0; c < count; ++c) {
            to_k[c] -= value * of_k[c];
          }
        }
      }
      if (i >= begin && i < end) {
        row[i - from] += 1;
      }
      for (int c = 0; c < to - from; ++c) {
        row[c] /= diagonal;
      }
    }
  });
}

}  // namespace atelier

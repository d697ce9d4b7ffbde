#include "simulation/projective/inverse_factor.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/projective/nested_dissection.h"

namespace atelier {
namespace {

constexpr int kSmallestPart = 33;  ///< unknowns; of fewer a warp has a thread for each
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
  NestedDissection dissection = nested_dissection(matrix, positions, kSmallestPart);
  order_ = std::move(dissection.order);
  for (const DissectedPart& part : dissection.parts) {
    for (int half : part.halves) {
      if (half >= 0) {
        parts_[half].parent = static_cast<int>(parts_.size());
      }
    }
    parts_.push_back({part.first, part.begin, part.end, -1, 0, 0, 0});
  }
  std::int64_t offset = 0;
  for (Part& part : parts_) {
    part.column = part.first / kAlign * kAlign;
    part.stride = rounded_up(part.end - part.column);
    part.offset = offset;
    offset += static_cast<std::int64_t>(part.end - part.begin) * part.stride;
  }
  const Eigen::SparseMatrix<double> permuted = in_order(matrix, order_);
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

bool half_precision_serves(const Eigen::SparseMatrix<double>& matrix,
                           const std::vector<double>& mass) {
  constexpr double kMostOverMass = 1e5;
  for (std::size_t u = 0; u < mass.size(); ++u) {
    const Index i = static_cast<Index>(u);
    if (matrix.coeff(i, i) > kMostOverMass * mass[u]) {
      return false;
    }
  }
  return true;
}

}  // namespace atelier

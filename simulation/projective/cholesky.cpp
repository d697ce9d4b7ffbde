#include "simulation/projective/cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "simulation/projective/nested_dissection.h"
#include "simulation/projective/panel_products.h"

namespace atelier {
namespace {

constexpr int kHalvings = 5;       ///< 32 subtrees that are solved in parallel
constexpr int kSmallestPart = 48;  ///< unknowns; smaller ones are not halved
/// Numbers in the panels: of fewer, a solution takes no longer than threads take to begin and end.
constexpr std::size_t kFewNumbers = std::size_t{1} << 18;

int round_up(int rows) {
  return (rows + 7) / 8 * 8;
}

}  // namespace

/// What is left of a part's rows when its own unknowns are eliminated, until the part that it
/// hands on to takes it over.
template <class T>
struct CholeskyFactor<T>::Front {
  Eigen::MatrixXd left;  ///< [later, later], lower triangle
};

template <class T>
CholeskyFactor<T>::CholeskyFactor(const Eigen::SparseMatrix<double>& matrix,
                                  const Points& positions) {
  const int n = static_cast<int>(matrix.rows());
  if (n == 0) {
    return;
  }
  NestedDissection dissection = nested_dissection(matrix, positions, kSmallestPart);
  order_ = std::move(dissection.order);
  levels_.resize(kHalvings + 1);
  for (const DissectedPart& part : dissection.parts) {
    parts_.push_back({part.begin, part.end, 0, 0, {part.halves[0], part.halves[1]}, 0, 0, 0});
    const int number = static_cast<int>(parts_.size()) - 1;
    const bool leaf = part.halves[0] < 0;
    if (part.depth == kHalvings || (leaf && part.depth < kHalvings)) {
      levels_[0].emplace_back(part.first_part, number + 1);
    } else if (part.depth < kHalvings) {
      levels_[static_cast<std::size_t>(kHalvings - part.depth)].emplace_back(number, number + 1);
    }
  }
  const Eigen::SparseMatrix<double> permuted = in_order(matrix, order_);
  find_rows(permuted);
  if (values_.size() < kFewNumbers) {
    levels_ = {{{0, static_cast<int>(parts_.size())}}};
  }
  factorise(permuted);
  solution_.resize(3 * static_cast<std::size_t>(n));
}

template <class T>
template <class Work>
void CholeskyFactor<T>::visit_up(const Work& work) const {
  for (const auto& level : levels_) {
    parallel_for(static_cast<Index>(level.size()), 1, [&](Index begin, Index end) {
      for (Index k = begin; k < end; ++k) {
        for (int p = level[k].first; p < level[k].second; ++p) {
          work(p);
        }
      }
    });
  }
}

template <class T>
template <class Work>
void CholeskyFactor<T>::visit_down(const Work& work) const {
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level) {
    parallel_for(static_cast<Index>(level->size()), 1, [&](Index begin, Index end) {
      for (Index k = begin; k < end; ++k) {
        for (int p = (*level)[k].second - 1; p >= (*level)[k].first; --p) {
          work(p);
        }
      }
    });
  }
}

/// A part is joined to what its unknowns are, and what its halves hand on.
template <class T>
void CholeskyFactor<T>::find_rows(const Eigen::SparseMatrix<double>& permuted) {
  std::size_t values = 0;
  std::size_t scratch = 0;
  for (Part& part : parts_) {
    std::vector<int> rows;
    for (int column = part.begin; column < part.end; ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(permuted, column); it; ++it) {
        if (it.row() >= part.end) {
          rows.push_back(static_cast<int>(it.row()));
        }
      }
    }
    for (int half : part.halves) {
      for (int r = half < 0 ? 0 : parts_[half].row_begin; half >= 0 && r < parts_[half].row_end;
           ++r) {
        if (rows_[r] >= part.end) {
          rows.push_back(rows_[r]);
        }
      }
    }
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    part.row_begin = static_cast<int>(rows_.size());
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    part.row_end = static_cast<int>(rows_.size());
    part.lead = round_up(part.own() + part.later());
    part.panel = values;
    part.scratch = scratch;
    values += static_cast<std::size_t>(part.lead) * static_cast<std::size_t>(part.own());
    scratch += 3 * static_cast<std::size_t>(part.lead);
  }
  values_.resize(values, T(0));
  scratch_.resize(scratch, T(0));
  place_in_next_.resize(rows_.size(), 0);
  for (const Part& part : parts_) {
    for (int half : part.halves) {
      for (int r = half < 0 ? 0 : parts_[half].row_begin; half >= 0 && r < parts_[half].row_end;
           ++r) {
        const auto first = rows_.begin() + part.row_begin;
        const auto found = std::lower_bound(first, rows_.begin() + part.row_end, rows_[r]);
        place_in_next_[r] = rows_[r] < part.end ? rows_[r] - part.begin
                                                : part.own() + static_cast<int>(found - first);
      }
    }
  }
}

template <class T>
void CholeskyFactor<T>::factorise(const Eigen::SparseMatrix<double>& permuted) {
  std::vector<Front> fronts(parts_.size());
  visit_up([&](int p) {
    const Part& part = parts_[p];
    const int own = part.own();
    Eigen::MatrixXd front = Eigen::MatrixXd::Zero(own + part.later(), own + part.later());
    for (int column = part.begin; column < part.end; ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(permuted, column); it; ++it) {
        const int row = static_cast<int>(it.row());
        const auto first = rows_.begin() + part.row_begin;
        const int place =
            row < part.end
                ? row - part.begin
                : own + static_cast<int>(
                            std::lower_bound(first, rows_.begin() + part.row_end, row) - first);
        front(place, column - part.begin) += it.value();
      }
    }
    for (int half : part.halves) {
      if (half < 0) {
        continue;
      }
      const Eigen::MatrixXd& handed = fronts[half].left;
      const int* const place = place_in_next_.data() + parts_[half].row_begin;
      for (Index column = 0; column < handed.cols(); ++column) {
        for (Index row = column; row < handed.rows(); ++row) {
          // Both lists ascend, so that the lower triangle stays one.
          front(place[row], place[column]) += handed(row, column);
        }
      }
      fronts[half].left.resize(0, 0);
    }
    Eigen::MatrixXd& left = fronts[p].left;
    if (own == 0) {
      left = std::move(front);
      return;
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(front.topLeftCorner(own, own));
    if (factor.info() != Eigen::Success) {
      throw DataError("", "material", "a matrix M + h^2 K that is not positive definite",
                      "stiffnesses and masses within double precision of each other, or a smaller "
                      "time step");
    }
    const Eigen::MatrixXd inverse = factor.matrixL().solve(Eigen::MatrixXd::Identity(own, own));
    const Eigen::MatrixXd below =
        front.bottomLeftCorner(part.later(), own) * inverse.transpose();  // L_RJ
    left = front.bottomRightCorner(part.later(), part.later());
    left.template selfadjointView<Eigen::Lower>().rankUpdate(below, -1.0);
    store_panel(part, inverse, below * inverse);
  });
}

template <class T>
void CholeskyFactor<T>::store_panel(const Part& part, const Eigen::MatrixXd& own,
                                    const Eigen::MatrixXd& below) {
  for (int column = 0; column < part.own(); ++column) {
    T* const to = values_.data() + part.panel +
                  static_cast<std::size_t>(column) * static_cast<std::size_t>(part.lead);
    for (int row = column; row < part.own(); ++row) {
      to[row] = static_cast<T>(own(row, column));
    }
    for (int row = 0; row < part.later(); ++row) {
      to[part.own() + row] = static_cast<T>(-below(row, column));
    }
  }
}

/// The part's share of L^-1 x: from what its halves hand on, its own and what it hands on.
template <class T>
void CholeskyFactor<T>::solve_up(const Part& part) {
  const int own = part.own();
  T* const sum = scratch_.data() + part.scratch;
  thread_local std::vector<T> right;
  right.resize(3 * static_cast<std::size_t>(own));
  const Index n = size();
  std::fill(sum, sum + 3 * static_cast<std::ptrdiff_t>(part.lead), T(0));
  for (int half : part.halves) {
    if (half < 0) {
      continue;
    }
    const Part& from = parts_[half];
    const int* const place = place_in_next_.data() + from.row_begin;
    for (int c = 0; c < 3; ++c) {
      const T* const handed =
          scratch_.data() + from.scratch + static_cast<std::ptrdiff_t>(c) * from.lead + from.own();
      T* const to = sum + static_cast<std::ptrdiff_t>(c) * part.lead;
      for (int r = 0; r < from.later(); ++r) {
        to[place[r]] += handed[r];
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    T* const to = sum + static_cast<std::ptrdiff_t>(c) * part.lead;
    for (int i = 0; i < own; ++i) {
      right[c * own + i] = solution_[c * n + part.begin + i] + to[i];
      to[i] = T(0);
    }
  }
  add_product(FactorPanel<T>{values_.data() + part.panel, part.lead, own}, right.data(), sum);
}

/// The part's unknowns, from its share of L^-1 x and the later ones.
template <class T>
void CholeskyFactor<T>::solve_down(const Part& part) {
  const int own = part.own();
  const Index n = size();
  T* const known = scratch_.data() + part.scratch;
  const int* const rows = rows_.data() + part.row_begin;
  thread_local std::vector<T> found;
  found.resize(3 * static_cast<std::size_t>(own));
  for (int c = 0; c < 3; ++c) {
    T* const to = known + static_cast<std::ptrdiff_t>(c) * part.lead + own;
    for (int r = 0; r < part.later(); ++r) {
      to[r] = solution_[c * n + rows[r]];
    }
  }
  transposed_product(FactorPanel<T>{values_.data() + part.panel, part.lead, own}, known,
                     found.data());
  for (int c = 0; c < 3; ++c) {
    std::copy_n(found.data() + static_cast<std::ptrdiff_t>(c) * own, own,
                solution_.data() + c * n + part.begin);
  }
}

template <class T>
void CholeskyFactor<T>::solve(std::vector<Vec4<double>>& x) {
  ATELIER_CHECK(x.size() == order_.size(), "right hand sides of another matrix");
  const Index n = size();
  const auto for_unknowns = [&](const auto& work) {
    parallel_for(n, 4096, [&](Index begin, Index end) {
      for (Index i = begin; i < end; ++i) {
        work(i);
      }
    });
  };
  for_unknowns([&](Index i) {
    const Vec4<double>& from = x[order_[i]];
    solution_[i] = static_cast<T>(from.x);
    solution_[n + i] = static_cast<T>(from.y);
    solution_[2 * n + i] = static_cast<T>(from.z);
  });
  visit_up([&](int p) { solve_up(parts_[p]); });
  visit_down([&](int p) { solve_down(parts_[p]); });
  for_unknowns([&](Index i) {
    x[order_[i]] = {static_cast<double>(solution_[i]), static_cast<double>(solution_[n + i]),
                    static_cast<double>(solution_[2 * n + i]), 0.0};
  });
}

template class CholeskyFactor<float>;
template class CholeskyFactor<double>;

}  // namespace atelier

#include "simulation/projective/nested_dissection.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace atelier {
namespace {

struct Dissector {
  const Eigen::SparseMatrix<double>& matrix;
  const Points& positions;
  int smallest;
  std::vector<int> side;  ///< of each unknown in the part that is being halved: 1, 2; else 0
  NestedDissection out;

  int append(const std::vector<int>& unknowns, DissectedPart part) {
    part.begin = static_cast<int>(out.order.size());
    out.order.insert(out.order.end(), unknowns.begin(), unknowns.end());
    part.end = static_cast<int>(out.order.size());
    out.parts.push_back(part);
    return static_cast<int>(out.parts.size()) - 1;
  }

  /// Marks both sides of the longest axis of their box.
  void halve(std::vector<int>& unknowns) {
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
  }

  /// Appends the unknowns to the order; returns their part, the last one.
  int dissect(std::vector<int> unknowns, int depth) {
    DissectedPart part{
        depth,   static_cast<int>(out.parts.size()), static_cast<int>(out.order.size()), 0, 0,
        {-1, -1}};
    if (static_cast<int>(unknowns.size()) < smallest) {
      return append(unknowns, part);
    }
    halve(unknowns);
    std::vector<int> halves[2];
    std::vector<int> joining;
    for (int u : unknowns) {
      bool joins = false;
      for (Eigen::SparseMatrix<double>::InnerIterator it(matrix, u); it; ++it) {
        joins = joins || (side[u] == 2 && side[it.row()] == 1);
      }
      (joins ? joining : halves[side[u] - 1]).push_back(u);
    }
    for (int u : unknowns) {
      side[u] = 0;
    }
    unknowns.clear();
    for (int k = 0; k < 2; ++k) {
      std::sort(halves[k].begin(), halves[k].end());
      if (!halves[k].empty()) {
        part.halves[k] = dissect(std::move(halves[k]), depth + 1);
      }
    }
    std::sort(joining.begin(), joining.end());
    return append(joining, part);
  }
};

}  // namespace

NestedDissection nested_dissection(const Eigen::SparseMatrix<double>& matrix,
                                   const Points& positions, int smallest) {
  const auto n = static_cast<std::size_t>(matrix.rows());
  if (n == 0) {
    return {};
  }
  Dissector dissector{matrix, positions, std::max(smallest, 2), std::vector<int>(n, 0), {}};
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  dissector.dissect(std::move(all), 0);
  return std::move(dissector.out);
}

Eigen::SparseMatrix<double> in_order(const Eigen::SparseMatrix<double>& matrix,
                                     const std::vector<int>& order) {
  const int n = static_cast<int>(order.size());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation(n);
  for (int i = 0; i < n; ++i) {
    permutation.indices()[order[i]] = i;
  }
  Eigen::SparseMatrix<double> out(n, n);
  out.selfadjointView<Eigen::Lower>() =
      matrix.selfadjointView<Eigen::Lower>().twistedBy(permutation);
  return out;
}

}  // namespace atelier

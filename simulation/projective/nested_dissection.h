#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "core/types.h"

namespace atelier {

/// Unknowns [begin, end) of the order: what joins two halves, or what is not halved any more.
struct DissectedPart {
  int depth;       ///< of how many halves it is one; 0: the last part
  int first_part;  ///< of its halves and theirs, which are the parts from there up to this one
  int first;       ///< [first, begin) of the order are its halves
  int begin, end;
  int halves[2];  ///< parts; -1: none
};

/// An order of unknowns in which a factor of their matrix has few numbers.
struct NestedDissection {
  std::vector<int> order;            ///< unknown at each place
  std::vector<DissectedPart> parts;  ///< halves before what joins them
};

/// Nested dissection (George 1973): unknowns are halved across the longest axis of their box, and
/// what joins the halves comes after both. A part of fewer than `smallest` unknowns is not halved.
/// In a part unknowns keep the order of their numbers, so that neighbours in the cloth stay
/// neighbours in memory.
/// @param matrix     [N,N] both triangles
/// @param positions  [N,3] of the unknowns; they decide about the order alone
NestedDissection nested_dissection(const Eigen::SparseMatrix<double>& matrix,
                                   const Points& positions, int smallest);

/// The lower triangle of a matrix, whose upper one may be there, in another order of its unknowns.
Eigen::SparseMatrix<double> in_order(const Eigen::SparseMatrix<double>& matrix,
                                     const std::vector<int>& order);

}  // namespace atelier

#pragma once

#include <vector>

namespace atelier {

/// Two nodes that cost `cost` where they are parted.
struct CutLink {
  std::size_t a = 0;
  std::size_t b = 0;
  double cost = 0;
};

/// Nodes in two sides so that the sum is least of `cost_first[i]` for each node of the first side,
/// `cost_second[i]` for each of the second and of what parted links cost (Boykov and Kolmogorov,
/// "An experimental comparison of min-cut/max-flow algorithms", 2004; Boost's). 1: the first side.
/// Nodes that cost the same on both sides are on the second.
///
/// Throws LogicError unless there are as many costs of both sides, links are between different
/// nodes and no cost is below 0.
std::vector<char> minimum_cut(const std::vector<double>& cost_first,
                              const std::vector<double>& cost_second,
                              const std::vector<CutLink>& links);

}  // namespace atelier

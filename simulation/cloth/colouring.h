#pragma once

#include <array>
#include <vector>

namespace atelier {

/// Colours for groups of up to four particles (-1 for unused places at the end), so that groups of
/// one colour share no particle: greedy, improved by going through the classes again from the last
/// to the first (Culberson 1992, "Iterated greedy graph coloring"), then evened out. As each colour
/// costs a GPU block a barrier, few colours come before even ones.
///
/// Particles are 0 to `particles` - 1. Returns the colour of each group, 0 upwards without gaps.
/// Cost: O(rounds x groups).
std::vector<int> colour_groups(const std::vector<std::array<int, 4>>& groups, int particles);

}  // namespace atelier

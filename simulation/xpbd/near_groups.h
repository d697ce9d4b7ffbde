#pragma once

#include <array>
#include <vector>

namespace atelier {

/// Primitives of a group, and groups of a larger one: a warp of a GPU.
constexpr int kGroup = 32;
/// Primitives of a group that lie closest together.
constexpr int kEight = 8;
constexpr int kEights = kGroup / kEight;

/// An order of things at `centres` in which each kGroup that follow one another, from the first on,
/// lie close together, each kEight of them, and each kGroup of such groups: median splits across
/// the longest side of their box, at whole groups. Our choice; boxes over such groups are what a
/// GPU looks through for contacts of cloth with itself. O(n log n).
std::vector<int> near_group_order(const std::vector<std::array<double, 3>>& centres);

}  // namespace atelier

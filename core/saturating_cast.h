#pragma once

#include <concepts>
#include <limits>

namespace atelier {

/// A computed number as an integer: its whole part, towards zero; the nearest integer that `To`
/// has where it has none so large or so small; 0 of NaN. A plain static_cast of such numbers is
/// undefined behaviour ([conv.fpint]), and they come from any file: of a camera that is turned by
/// 90 degrees a pixel is anywhere. Round with std::floor, std::ceil or std::round first. Every
/// conversion of a floating-point number to an integer goes through here, but those in the inner
/// loops that `tests/build/cast_law_test.cpp` names, each with the reason why it stays inside.
template <std::integral To, std::floating_point From>
constexpr To saturating_cast(From value) noexcept {
  using Range = std::numeric_limits<To>;
  // One above the largest: a power of two, which every floating type holds; the largest itself
  // often is none.
  constexpr To kHalf = static_cast<To>(Range::max() / 2 + 1);
  constexpr From kAbove = From(2) * static_cast<From>(kHalf);
  constexpr From kLowest = static_cast<From>(Range::min());
  if (!(value > kLowest)) {
    return value <= kLowest ? Range::min() : To{};
  }
  return value < kAbove ? static_cast<To>(value) : Range::max();
}

}  // namespace atelier

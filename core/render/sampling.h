#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/render/vector_math.h"

namespace atelier {

/// A point of the unit square.
struct Point2f {
  float x, y;
};

namespace sobol {

constexpr std::uint32_t reversed_bits(std::uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00FF00FFu) << 8) | ((x & 0xFF00FF00u) >> 8);
  x = ((x & 0x0F0F0F0Fu) << 4) | ((x & 0xF0F0F0F0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xCCCCCCCCu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xAAAAAAAAu) >> 1);
}

constexpr std::uint32_t mixed_bits(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7FEB352Du;
  x ^= x >> 15;
  x *= 0x846CA68Bu;
  return x ^ (x >> 16);
}

/// Owen scrambling of a bit-reversed number (Laine and Karras 2011 as improved by Burley 2020).
constexpr std::uint32_t scrambled_reversed(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6C50B47Cu;
  x ^= x * 0xB82F1E52u;
  x ^= x * 0xC7AFE638u;
  x ^= x * 0x8D22F6E6u;
  return x;
}

constexpr std::uint32_t scrambled(std::uint32_t x, std::uint32_t seed) {
  return reversed_bits(scrambled_reversed(reversed_bits(x), seed));
}

/// Second dimension of Sobol's sequence for one byte of the index; `shift` is the byte's place.
constexpr std::array<std::uint32_t, 256> second_dimension_table(int shift) {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t column = 1u << 31;
    std::uint32_t value = 0;
    for (std::uint32_t bits = byte << shift; bits != 0; bits >>= 1, column ^= column >> 1) {
      if ((bits & 1u) != 0) {
        value ^= column;
      }
    }
    table[byte] = value;
  }
  return table;
}

inline constexpr std::array<std::uint32_t, 256> kLowByte = second_dimension_table(0);
inline constexpr std::array<std::uint32_t, 256> kHighByte = second_dimension_table(8);

inline float unit_float(std::uint32_t x) {
  return static_cast<float>(x >> 8) * 0x1p-24f;
}

}  // namespace sobol

/// Point `index` (below 65,536) of the shuffled, Owen-scrambled two-dimensional Sobol sequence that
/// `seed` names (Burley, "Practical hash-based Owen scrambling", JCGT 2020): any aligned run of 2^m
/// points is a (0,m,2)-net, so that every number of samples is well spread.
inline Point2f sobol_point(std::uint32_t index, std::uint32_t seed) {
  const std::uint32_t i = sobol::scrambled(index, seed) & 0xFFFFu;
  // The first dimension is the index with its bits reversed.
  const std::uint32_t x =
      sobol::reversed_bits(sobol::scrambled_reversed(i, sobol::mixed_bits(seed ^ 0x68BC21EBu)));
  const std::uint32_t y = sobol::scrambled(sobol::kLowByte[i & 255u] ^ sobol::kHighByte[i >> 8],
                                           sobol::mixed_bits(seed ^ 0x02E5BE93u));
  return {sobol::unit_float(x), sobol::unit_float(y)};
}

/// Direction about +Z with density cos / pi (Malley's method on a concentric disk, Shirley and Chiu
/// 1997).
inline Vec3f cosine_direction(Point2f u) {
  const float a = 2 * u.x - 1;
  const float b = 2 * u.y - 1;
  constexpr float kQuarterPi = static_cast<float>(std::numbers::pi / 4);
  float radius = 0;
  float angle = 0;
  if (std::abs(a) > std::abs(b)) {
    radius = a;
    angle = kQuarterPi * (b / a);
  } else if (b != 0) {
    radius = b;
    angle = 2 * kQuarterPi - kQuarterPi * (a / b);
  }
  return {radius * std::cos(angle), radius * std::sin(angle),
          std::sqrt(std::max(0.0f, 1 - radius * radius))};
}

}  // namespace atelier

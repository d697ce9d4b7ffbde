#include "core/random.h"

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace atelier {
namespace {

std::uint64_t next_bits(Random& random) {
  const RandomWords words = random_words(random.seed, random.stream, random.counter++);
  return (static_cast<std::uint64_t>(words.word[1]) << 32) | words.word[0];
}

}  // namespace

double uniform(Random& random) {
  return static_cast<double>(next_bits(random) >> 11) * 0x1.0p-53;
}

double uniform(Random& random, double low, double high) {
  return low + (high - low) * uniform(random);
}

std::uint64_t uniform_index(Random& random, std::uint64_t n) {
  ATELIER_CHECK(n > 0, "uniform_index needs n > 0");
  const std::uint64_t unbiased_from = (0 - n) % n;  // 2^64 mod n
  std::uint64_t bits = next_bits(random);
  while (bits < unbiased_from) {
    bits = next_bits(random);
  }
  return bits % n;
}

double normal(Random& random) {
  const double u = 1.0 - uniform(random);  // in (0, 1]
  const double v = uniform(random);
  return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * std::numbers::pi * v);
}

}  // namespace atelier

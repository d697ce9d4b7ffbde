#include "core/mark/mark_pattern.h"

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/mark/mark_code.h"
#include "core/random.h"

namespace atelier {
namespace {

constexpr std::uint64_t kPublicKey = 0x6174656c69657231;  // "atelier1"

MarkCarriers carriers_of(std::uint64_t key) {
  Random random{.seed = key};
  std::vector<MarkCarrier> all;
  for (int u = 0; u < kMarkWaves; ++u) {
    for (int v = 1 - kMarkWaves; v < kMarkWaves; ++v) {
      const double waves = std::hypot(u, v);
      if (waves < kMarkLowest || waves > kMarkHighest || (u == 0 && v < 0)) {
        continue;
      }
      const double angle = uniform(random, 0, 2 * std::numbers::pi);
      all.push_back(
          {u, v, {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle))}});
    }
  }
  for (std::size_t i = all.size() - 1; i > 0; --i) {
    std::swap(all[i], all[uniform_index(random, i + 1)]);
  }
  const auto first_pilot = all.begin() + kMarkCodeBits;
  return {.pilots = {first_pilot, all.end()}, .code = {all.begin(), first_pilot}};
}

}  // namespace

const MarkCarriers& mark_carriers() {
  static const MarkCarriers carriers = carriers_of(kPublicKey);
  return carriers;
}

std::vector<float> mark_tile(std::uint64_t bits) {
  static const auto wave = [] {
    std::array<std::complex<float>, kMarkTile> values;
    for (int i = 0; i < kMarkTile; ++i) {
      const double angle = 2 * std::numbers::pi * i / kMarkTile;
      values[static_cast<std::size_t>(i)] = {static_cast<float>(std::cos(angle)),
                                             static_cast<float>(std::sin(angle))};
    }
    return values;
  }();
  const auto at = [](int turns) {
    return wave[static_cast<std::size_t>((turns % kMarkTile + kMarkTile) % kMarkTile)];
  };
  // Waves along y of each u, then along x.
  std::vector<std::complex<float>> columns(std::size_t{kMarkWaves} * kMarkTile);
  const auto add = [&](const MarkCarrier& carrier, float sign) {
    for (int y = 0; y < kMarkTile; ++y) {
      columns[static_cast<std::size_t>(carrier.u * kMarkTile + y)] +=
          sign * carrier.phase * at(carrier.v * y);
    }
  };
  const MarkCarriers& carriers = mark_carriers();
  const std::vector<std::uint8_t> code = mark_code(bits);
  for (const MarkCarrier& pilot : carriers.pilots) {
    add(pilot, 1);
  }
  for (std::size_t i = 0; i < code.size(); ++i) {
    add(carriers.code[i], code[i] != 0 ? -1.0f : 1.0f);
  }
  // A wave of size 1 has mean square 1/2.
  const float size = std::sqrt(2.0f / static_cast<float>(carriers.pilots.size() + code.size()));
  std::vector<float> tile(std::size_t{kMarkTile} * kMarkTile);
  for (int y = 0; y < kMarkTile; ++y) {
    for (int u = 0; u < kMarkWaves; ++u) {
      const std::complex<float> column =
          size * columns[static_cast<std::size_t>(u * kMarkTile + y)];
      for (int x = 0; x < kMarkTile; ++x) {
        const std::complex<float> along = at(u * x);
        tile[static_cast<std::size_t>(y * kMarkTile + x)] +=
            column.real() * along.real() - column.imag() * along.imag();
      }
    }
  }
  return tile;
}

}  // namespace atelier

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/error.h"
#include "core/mark/image_mark.h"
#include "core/mark/mark_code.h"
#include "core/mark/mark_pattern.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

using Plane = ImageOf<float>;
using Complex = std::complex<float>;

constexpr int kGrid = 64;                  // samples a tile, of the image that is looked through
constexpr int kShifts = 128;               // places a tile that the pattern is looked for at first
constexpr int kRows = 2 * kMarkWaves - 1;  // waves along y: -22 .. 22
constexpr int kFirstTiles = 6;  // a side, from the middle: more would ask for finer sizes at first
constexpr double kSizeStep = 0.006;  // of the size, at first
constexpr double kFineStep = 0.0015;
constexpr int kFineSteps = 4;  // to either side
constexpr int kCandidates = 16;
constexpr std::array<double, 8> kCommonSizes = {1, 1.0 / 3, 0.5, 2.0 / 3, 0.75, 2, 1.5, 1.25};

/// Means of an axis' samples over equal stretches: first sample and weights of each.
struct Stretches {
  std::vector<int> first;
  std::vector<std::vector<float>> weights;
};

/// Stretches of length `pitch` (at least one sample) that fill an axis from `start` on.
Stretches stretches_of(int samples, double start, double pitch, int count) {
  Stretches all;
  const double half = std::max(pitch, 1.0) / 2;
  for (int i = 0; i < count; ++i) {
    const double middle = start + (i + 0.5) * pitch;
    const double low = std::clamp(middle - half, 0.0, samples - 1.0);
    const double high = std::clamp(middle + half, low + 1e-3, static_cast<double>(samples));
    const int first = saturating_cast<int>(std::floor(low));
    const int end = std::min(samples, saturating_cast<int>(std::ceil(high)));
    std::vector<float> weights;
    for (int s = first; s < end; ++s) {
      const double covered = std::min(high, s + 1.0) - std::max(low, static_cast<double>(s));
      weights.push_back(static_cast<float>(covered / (high - low)));
    }
    all.first.push_back(first);
    all.weights.push_back(std::move(weights));
  }
  return all;
}

/// The image with kGrid samples a tile, if its tiles have `tile` pixels; of the middle alone where
/// it has more than `most` samples a side.
Plane resampled(const Plane& image, double tile, int most) {
  const double pitch = tile / kGrid;
  const auto count = [&](int side) {
    return std::clamp(saturating_cast<int>(std::floor(side / pitch)), 1, most);
  };
  const int width = count(image.width);
  const int height = count(image.height);
  const Stretches columns =
      stretches_of(image.width, (image.width - width * pitch) / 2, pitch, width);
  const Stretches rows =
      stretches_of(image.height, (image.height - height * pitch) / 2, pitch, height);
  Plane small(width, height, 1);
  std::vector<float> line(static_cast<std::size_t>(image.width));
  for (int y = 0; y < height; ++y) {
    std::fill(line.begin(), line.end(), 0.0f);
    const std::vector<float>& down = rows.weights[static_cast<std::size_t>(y)];
    for (std::size_t k = 0; k < down.size(); ++k) {
      const float* source =
          &image.at(0, rows.first[static_cast<std::size_t>(y)] + static_cast<int>(k));
      for (std::size_t x = 0; x < line.size(); ++x) {
        line[x] += down[k] * source[x];
      }
    }
    for (int x = 0; x < width; ++x) {
      const std::vector<float>& across = columns.weights[static_cast<std::size_t>(x)];
      const float* source = line.data() + columns.first[static_cast<std::size_t>(x)];
      float sum = 0;
      for (std::size_t k = 0; k < across.size(); ++k) {
        sum += across[k] * source[k];
      }
      small.at(x, y) = sum;
    }
  }
  return small;
}

/// Means over squares of 2 radius + 1 samples, cut off at the edges.
Plane square_means(const Plane& plane, int radius) {
  Plane across(plane.width, plane.height, 1);
  for (int y = 0; y < plane.height; ++y) {
    float sum = 0;
    for (int x = 0; x < std::min(radius, plane.width); ++x) {
      sum += plane.at(x, y);
    }
    for (int x = 0; x < plane.width; ++x) {
      sum += x + radius < plane.width ? plane.at(x + radius, y) : 0.0f;
      sum -= x - radius - 1 >= 0 ? plane.at(x - radius - 1, y) : 0.0f;
      across.at(x, y) = sum / static_cast<float>(std::min(x + radius, plane.width - 1) -
                                                 std::max(x - radius, 0) + 1);
    }
  }
  Plane means(plane.width, plane.height, 1);
  std::vector<float> sums(static_cast<std::size_t>(plane.width));
  const auto add_row = [&](int y, float sign) {
    for (int x = 0; x < plane.width; ++x) {
      sums[static_cast<std::size_t>(x)] += sign * across.at(x, y);
    }
  };
  for (int y = 0; y < std::min(radius, plane.height); ++y) {
    add_row(y, 1);
  }
  for (int y = 0; y < plane.height; ++y) {
    if (y + radius < plane.height) {
      add_row(y + radius, 1);
    }
    if (y - radius - 1 >= 0) {
      add_row(y - radius - 1, -1);
    }
    const float count =
        static_cast<float>(std::min(y + radius, plane.height - 1) - std::max(y - radius, 0) + 1);
    for (int x = 0; x < plane.width; ++x) {
      means.at(x, y) = sums[static_cast<std::size_t>(x)] / count;
    }
  }
  return means;
}

/// What is finer than the mark's longest waves, over its local size, so that busy places drown
/// nothing; laid over itself tile by tile.
std::array<float, std::size_t{kGrid} * kGrid> folded(Plane plane) {
  constexpr int kCoarse = 5;      // samples: radius of what is taken away
  constexpr int kAround = 4;      // samples: radius of what is local
  constexpr float kStill = 0.6f;  // grey levels: less than that is not blown up
  constexpr float kOutlier = 2.5f;
  const Plane coarse = square_means(square_means(plane, kCoarse), kCoarse);
  Plane squares(plane.width, plane.height, 1);
  for (std::size_t i = 0; i < plane.data.size(); ++i) {
    plane.data[i] -= coarse.data[i];
    squares.data[i] = plane.data[i] * plane.data[i];
  }
  const Plane local = square_means(squares, kAround);
  std::array<float, std::size_t{kGrid} * kGrid> tile{};
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) {
      const float size = std::sqrt(std::max(0.0f, local.at(x, y)) + kStill * kStill);
      tile[static_cast<std::size_t>(y % kGrid * kGrid + x % kGrid)] +=
          std::clamp(plane.at(x, y) / size, -kOutlier, kOutlier);
    }
  }
  return tile;
}

/// e^(2 pi i k / kShifts).
Complex turn(int k) {
  static const auto turns = [] {
    std::array<Complex, kShifts> all;
    for (int i = 0; i < kShifts; ++i) {
      const double angle = 2 * std::numbers::pi * i / kShifts;
      all[static_cast<std::size_t>(i)] = {static_cast<float>(std::cos(angle)),
                                          static_cast<float>(std::sin(angle))};
    }
    return all;
  }();
  return turns[static_cast<std::size_t>((k % kShifts + kShifts) % kShifts)];
}

/// Waves of a folded image: [u * kRows + v + 22], each ring of equal u^2 + v^2 made equally strong,
/// since what an image shows has long waves above all.
using Waves = std::array<Complex, std::size_t{kMarkWaves} * kRows>;

std::size_t wave_index(int u, int v) {
  return static_cast<std::size_t>(u * kRows + v + kMarkWaves - 1);
}

int ring_of(int u, int v) {
  return saturating_cast<int>(std::round(std::hypot(u, v)));
}

Waves waves_of(const std::array<float, std::size_t{kGrid} * kGrid>& tile) {
  constexpr int kStep = kShifts / kGrid;
  Waves waves{};
  std::array<Complex, std::size_t{kMarkWaves} * kGrid> across{};
  for (int u = 0; u < kMarkWaves; ++u) {
    for (int y = 0; y < kGrid; ++y) {
      Complex sum = 0;
      for (int x = 0; x < kGrid; ++x) {
        sum += tile[static_cast<std::size_t>(y * kGrid + x)] * std::conj(turn(kStep * u * x));
      }
      across[static_cast<std::size_t>(u * kGrid + y)] = sum;
    }
  }
  std::array<float, 2 * kMarkWaves> power{};
  std::array<float, 2 * kMarkWaves> count{};
  for (int u = 0; u < kMarkWaves; ++u) {
    for (int v = 1 - kMarkWaves; v < kMarkWaves; ++v) {
      Complex sum = 0;
      for (int y = 0; y < kGrid; ++y) {
        sum += across[static_cast<std::size_t>(u * kGrid + y)] * std::conj(turn(kStep * v * y));
      }
      waves[wave_index(u, v)] = sum;
      power[static_cast<std::size_t>(ring_of(u, v))] += std::norm(sum);
      ++count[static_cast<std::size_t>(ring_of(u, v))];
    }
  }
  for (int u = 0; u < kMarkWaves; ++u) {
    for (int v = 1 - kMarkWaves; v < kMarkWaves; ++v) {
      const auto ring = static_cast<std::size_t>(ring_of(u, v));
      waves[wave_index(u, v)] /= std::sqrt(power[ring] / count[ring] + 1e-12f);
    }
  }
  return waves;
}

/// Where a pattern may lie: in samples from the grid's, and how far it stands out.
struct Place {
  double size = 1;
  float x = 0;
  float y = 0;
  float pilot = 0;
  Waves waves;
};

/// The wave of a carrier as it would be, were the pattern at (x, y), over the carrier's phase.
Complex against(const Waves& waves, const MarkCarrier& carrier, float x, float y) {
  const float angle = 2 * std::numbers::pi_v<float> / kGrid *
                      (static_cast<float>(carrier.u) * x + static_cast<float>(carrier.v) * y);
  return waves[wave_index(carrier.u, carrier.v)] * std::conj(carrier.phase) *
         Complex(std::cos(angle), std::sin(angle));
}

/// Of chance alone it has the standard deviation 1.
float pilot_at(const Waves& waves, float x, float y) {
  const std::vector<MarkCarrier>& pilots = mark_carriers().pilots;
  float sum = 0;
  for (const MarkCarrier& pilot : pilots) {
    sum += against(waves, pilot, x, y).real();
  }
  return sum / std::sqrt(static_cast<float>(pilots.size()) / 2);
}

/// The best place of the pattern in an image of that size, to half a sample.
Place first_place(const Plane& image, double size, int most) {
  Place place{.size = size, .waves = waves_of(folded(resampled(image, size * kMarkTile, most)))};
  std::vector<Complex> columns(std::size_t{kMarkWaves} * kShifts);
  for (const MarkCarrier& pilot : mark_carriers().pilots) {
    const Complex wave = place.waves[wave_index(pilot.u, pilot.v)] * std::conj(pilot.phase);
    for (int y = 0; y < kShifts; ++y) {
      columns[static_cast<std::size_t>(pilot.u * kShifts + y)] += wave * turn(pilot.v * y);
    }
  }
  std::array<float, kShifts> line;
  float most_yet = -1;
  for (int y = 0; y < kShifts; ++y) {
    line.fill(0);
    for (int u = 0; u < kMarkWaves; ++u) {
      const Complex column = columns[static_cast<std::size_t>(u * kShifts + y)];
      for (int x = 0; x < kShifts; ++x) {
        const Complex along = turn(u * x);
        line[static_cast<std::size_t>(x)] +=
            column.real() * along.real() - column.imag() * along.imag();
      }
    }
    const auto best = std::max_element(line.begin(), line.end());
    if (*best > most_yet) {
      most_yet = *best;
      place.x = static_cast<float>(best - line.begin()) * kGrid / kShifts;
      place.y = static_cast<float>(y) * kGrid / kShifts;
    }
  }
  place.pilot = pilot_at(place.waves, place.x, place.y);
  return place;
}

/// The place to a sixteenth of a sample.
void refine(Place& place) {
  for (float step = 0.25f; step > 0.05f; step /= 2) {
    const Place from = place;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const float x = from.x + step * static_cast<float>(dx);
        const float y = from.y + step * static_cast<float>(dy);
        const float pilot = pilot_at(from.waves, x, y);
        if (pilot > place.pilot) {
          place.x = x;
          place.y = y;
          place.pilot = pilot;
        }
      }
    }
  }
}

/// The code's values at a place, each as far as its ring of waves can be believed: as the pilots of
/// waves about as long agree.
std::vector<float> soft_code(const Place& place) {
  constexpr float kBand = 3;  // rings to either side
  const MarkCarriers& carriers = mark_carriers();
  std::array<float, 2 * kMarkWaves> agreement{};
  for (int ring = 0; ring < 2 * kMarkWaves; ++ring) {
    float sum = 0;
    float count = 1;
    for (const MarkCarrier& pilot : carriers.pilots) {
      if (std::abs(static_cast<float>(ring_of(pilot.u, pilot.v) - ring)) <= kBand) {
        sum += against(place.waves, pilot, place.x, place.y).real();
        ++count;
      }
    }
    agreement[static_cast<std::size_t>(ring)] = std::max(0.02f, sum / count);
  }
  std::vector<float> soft;
  soft.reserve(carriers.code.size());
  for (const MarkCarrier& carrier : carriers.code) {
    soft.push_back(agreement[static_cast<std::size_t>(ring_of(carrier.u, carrier.v))] *
                   against(place.waves, carrier, place.x, place.y).real());
  }
  return soft;
}

/// The best place near a size, over the whole image.
Place best_near(const Plane& image, double size, int steps) {
  std::vector<Place> places(static_cast<std::size_t>(2 * steps + 1));
  parallel_for(std::ssize(places), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      Place& place = places[static_cast<std::size_t>(i)];
      place = first_place(image, size * (1 + kFineStep * static_cast<double>(i - steps)),
                          image.width + image.height);
      refine(place);
    }
  });
  return *std::max_element(places.begin(), places.end(),
                           [](const Place& a, const Place& b) { return a.pilot < b.pilot; });
}

/// Decodes what is at a place. True once a mark is found.
bool decode_at(const Place& place, MarkSearch& search) {
  if (std::ssize(search.tried) >= kMarkTries) {
    return false;
  }
  const DecodedMark decoded = decode_mark(soft_code(place));
  search.tried.push_back(decoded.difference);
  if (decoded.difference == 0) {
    search.found = FoundMark{.bits = decoded.bits, .size = place.size, .pilot = place.pilot};
  }
  return search.found.has_value();
}

/// Sizes in steps, from the smallest to the largest.
std::vector<double> sizes_of(const MarkSearchOptions& options) {
  std::vector<double> sizes;
  for (double size = options.smallest; size <= options.largest; size *= 1 + kSizeStep) {
    sizes.push_back(size);
  }
  return sizes;
}

}  // namespace

MarkSearch find_mark(const ImageOf<float>& brightness, const MarkSearchOptions& options) {
  ATELIER_CHECK(brightness.channels == 1, "a mark is looked for in brightness alone");
  ATELIER_CHECK(
      options.smallest >= 0.1 && options.smallest <= options.largest && options.largest <= 4,
      "sizes of marks lie in [0.1, 4]");
  MarkSearch search;
  constexpr int kLeast = 24;  // pixels a side
  if (brightness.width < kLeast || brightness.height < kLeast) {
    return search;
  }
  for (const double size : kCommonSizes) {
    if (size >= options.smallest && size <= options.largest &&
        decode_at(best_near(brightness, size, 1), search)) {
      return search;
    }
  }
  const std::vector<double> sizes = sizes_of(options);
  std::vector<std::pair<float, double>> places(sizes.size());
  parallel_for(std::ssize(sizes), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) {
      const double size = sizes[static_cast<std::size_t>(i)];
      places[static_cast<std::size_t>(i)] = {
          first_place(brightness, size, kFirstTiles * kGrid).pilot, size};
    }
  });
  std::sort(places.begin(), places.end(), std::greater<>());
  places.resize(std::min<std::size_t>(places.size(), kCandidates));
  for (const auto& [pilot, size] : places) {
    if (decode_at(best_near(brightness, size, kFineSteps), search)) {
      return search;
    }
  }
  return search;
}

}  // namespace atelier

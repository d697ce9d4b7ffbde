#include "capture/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/parallel.h"
#include "core/types.h"

namespace atelier {
namespace {

/// Four standard normals of one counter (Box-Muller).
std::array<float, 4> normals(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
  const RandomWords words = random_words(seed, stream, counter);
  std::array<float, 4> result{};
  for (std::size_t i = 0; i < 4; i += 2) {
    const float u = (static_cast<float>(words.word[i] >> 8) + 1) * 0x1.0p-24F;
    const float v = static_cast<float>(words.word[i + 1] >> 8) * 0x1.0p-24F;
    const float radius = std::sqrt(-2 * std::log(u));
    const float angle = 2 * std::numbers::pi_v<float> * v;
    result[i] = radius * std::cos(angle);
    result[i + 1] = radius * std::sin(angle);
  }
  return result;
}

}  // namespace

OptionTable describe(SensorOptions& options) {
  OptionTable table;
  table.add("exposure", options.exposure, 1e-3, 100, "", "Factor on the light")
      .add("shot_noise", options.shot_noise, 0, 1, "",
           "Standard deviation of the noise at full light, which grows with the square root of the "
           "light")
      .add("read_noise", options.read_noise, 0, 1, "",
           "Standard deviation of the noise in the dark");
  return table;
}

Image exposed(const Image& image, const Eigen::Vector3d& gain, const SensorOptions& options) {
  ATELIER_CHECK(image.channels == 3, "a sensor takes three channels");
  Image result = image;
  std::array<float, 3> factor{};
  for (int c = 0; c < 3; ++c) {
    factor[static_cast<std::size_t>(c)] = static_cast<float>(options.exposure * gain[c]);
  }
  for (std::size_t i = 0; i < result.data.size(); ++i) {
    result.data[i] *= factor[i % 3];
  }
  return result;
}

Image noisy(const Image& image, const SensorOptions& options, std::uint64_t seed,
            std::uint64_t stream) {
  ATELIER_CHECK(image.channels == 3, "a sensor takes three channels");
  Image result = image;
  const auto shot = static_cast<float>(options.shot_noise * options.shot_noise);
  const auto read = static_cast<float>(options.read_noise * options.read_noise);
  const Index pixels = static_cast<Index>(image.width) * image.height;
  parallel_for(pixels, 1 << 15, [&](Index begin, Index end) {
    for (Index p = begin; p < end; ++p) {
      const std::array<float, 4> z = normals(seed, stream, static_cast<std::uint64_t>(p));
      for (Index c = 0; c < 3; ++c) {
        float& value = result.data[static_cast<std::size_t>(3 * p + c)];
        value += std::sqrt(shot * std::max(0.0F, value) + read) * z[static_cast<std::size_t>(c)];
      }
    }
  });
  return result;
}

}  // namespace atelier

#include "appearance/texture_sampling.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

void add_splat(Image& texture, std::vector<float>& weights, const TexturePixels& places,
               const std::vector<float>& colors) {
  for (std::size_t p = 0; p < places.u.size(); ++p) {
    const TextureTaps taps = texture_taps(texture.width, places.u[p], places.v[p]);
    const float importance = places.weights.empty() ? 1.0F : places.weights[p];
    for (std::size_t k = 0; k < 4; ++k) {
      const auto texel = static_cast<std::size_t>(taps.texel[k]);
      for (std::size_t c = 0; c < 3; ++c) {
        texture.data[3 * texel + c] += importance * taps.weight[k] * colors[3 * p + c];
      }
      weights[texel] += importance * taps.weight[k];
    }
  }
}

/// 1 for texels that some pixel takes for half of its colour. What pixels touch with less is not
/// known by them: it would take a residual many times over, and become black or white. Where pixels
/// are coarser than texels, so that this leaves out most of what they touch, less will do.
ImageOf<std::uint8_t> seen_texels(int resolution, const std::vector<TextureView>& views) {
  Image most(resolution, resolution, 1);
  for (const TextureView& view : views) {
    for (std::size_t p = 0; p < view.pixels->u.size(); ++p) {
      const TextureTaps taps = texture_taps(resolution, view.pixels->u[p], view.pixels->v[p]);
      for (std::size_t k = 0; k < 4; ++k) {
        float& weight = most.data[static_cast<std::size_t>(taps.texel[k])];
        weight = std::max(weight, taps.weight[k]);
      }
    }
  }
  const auto above = [&](float least) {
    return std::count_if(most.data.begin(), most.data.end(), [&](float w) { return w > least; });
  };
  float least = 0.5F;
  for (const float less : {0.2F, 0.0F}) {
    least = 2 * above(least) < above(0) ? less : least;
  }
  ImageOf<std::uint8_t> seen(resolution, resolution, 1);
  for (std::size_t t = 0; t < most.data.size(); ++t) {
    seen.data[t] = most.data[t] > least ? 1 : 0;
  }
  return seen;
}

/// Draws each seen texel towards the mean of its seen neighbours, which counts as so many pixels.
void draw_to_neighbours(StaticTexture& fixed, const std::vector<float>& weights, float pixels) {
  const Image before = fixed.texture;
  const int side = before.width;
  const auto seen_at = [&](int x, int y) {
    return x >= 0 && x < side && y >= 0 && y < side && fixed.seen.at(x, y) != 0;
  };
  constexpr std::array<std::array<int, 2>, 4> kSteps = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      if (!seen_at(x, y)) {
        continue;
      }
      const float weight = weights[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) +
                                   static_cast<std::size_t>(x)];
      const float share = pixels / (pixels + weight);
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        int count = 0;
        for (const auto& [dx, dy] : kSteps) {
          if (seen_at(x + dx, y + dy)) {
            sum += before.at(x + dx, y + dy, c);
            ++count;
          }
        }
        if (count > 0) {
          const float own = before.at(x, y, c);
          fixed.texture.at(x, y, c) = own + share * (sum / static_cast<float>(count) - own);
        }
      }
    }
  }
}

}  // namespace

TextureTaps texture_taps(int resolution, float u, float v) {
  const float last = static_cast<float>(resolution - 1);
  const float size = static_cast<float>(resolution);
  const float x = std::clamp(u * size - 0.5F, 0.0F, last);
  const float y = std::clamp((1 - v) * size - 0.5F, 0.0F, last);
  const int x0 = std::min(saturating_cast<int>(x), std::max(0, resolution - 2));
  const int y0 = std::min(saturating_cast<int>(y), std::max(0, resolution - 2));
  const int x1 = std::min(x0 + 1, resolution - 1);
  const int y1 = std::min(y0 + 1, resolution - 1);
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  return {{y0 * resolution + x0, y0 * resolution + x1, y1 * resolution + x0, y1 * resolution + x1},
          {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
}

std::vector<float> sample_texture(const Image& texture, const TexturePixels& places) {
  ATELIER_CHECK(texture.width == texture.height && texture.channels == 3 && texture.width > 0,
                "a texture is square and has 3 channels");
  ATELIER_CHECK(places.u.size() == places.v.size(), "u and v differ in number");
  std::vector<float> colors(3 * places.u.size());
  constexpr Index kGrain = 8192;
  parallel_for(static_cast<Index>(places.u.size()), kGrain, [&](Index begin, Index end) {
    for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p) {
      const TextureTaps taps = texture_taps(texture.width, places.u[p], places.v[p]);
      for (std::size_t c = 0; c < 3; ++c) {
        float sum = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          sum += taps.weight[k] * texture.data[3 * static_cast<std::size_t>(taps.texel[k]) + c];
        }
        colors[3 * p + c] = sum;
      }
    }
  });
  return colors;
}

StaticTexture static_texture(int resolution, int cameras, const std::vector<TextureView>& views,
                             int rounds, double smoothness) {
  ATELIER_CHECK(resolution > 0 && cameras > 0 && rounds >= 1 && smoothness >= 0,
                "sizes and rounds are positive, smoothness is not negative");
  for (const TextureView& view : views) {
    ATELIER_CHECK(
        view.camera_idx >= 0 && view.camera_idx < cameras && view.pixels != nullptr &&
            view.pixels->colors.size() == 3 * view.pixels->u.size() &&
            (view.pixels->weights.empty() || view.pixels->weights.size() == view.pixels->u.size()),
        "a view needs a camera and colours, and each pixel a weight or none");
  }
  StaticTexture result;
  result.texture = Image(resolution, resolution, 3);
  result.gain.assign(3 * static_cast<std::size_t>(cameras), 1.0F);
  std::vector<float> weights(static_cast<std::size_t>(resolution) * resolution, 0.0F);
  std::vector<float> residual;
  result.seen = seen_texels(resolution, views);
  for (int round = 0; round < rounds; ++round) {
    constexpr int kSteps = 5;
    for (int step = 0; step < kSteps; ++step) {
      Image change(resolution, resolution, 3);
      std::fill(weights.begin(), weights.end(), 0.0F);
      for (const TextureView& view : views) {
        residual = sample_texture(result.texture, *view.pixels);
        const float* gain = &result.gain[3 * static_cast<std::size_t>(view.camera_idx)];
        for (std::size_t i = 0; i < residual.size(); ++i) {
          residual[i] = view.pixels->colors[i] / gain[i % 3] - residual[i];
        }
        add_splat(change, weights, *view.pixels, residual);
      }
      for (std::size_t t = 0; t < weights.size(); ++t) {
        for (std::size_t c = 0; c < 3 && result.seen.data[t] != 0 && weights[t] > 0; ++c) {
          float& value = result.texture.data[3 * t + c];
          value = std::max(0.0F, value + change.data[3 * t + c] / weights[t]);
        }
      }
      if (smoothness > 0) {
        draw_to_neighbours(result, weights, static_cast<float>(smoothness));
      }
    }
    std::vector<double> with(result.gain.size(), 0);
    std::vector<double> own(result.gain.size(), 0);
    for (const TextureView& view : views) {
      const std::vector<float> shown = sample_texture(result.texture, *view.pixels);
      const std::size_t first = 3 * static_cast<std::size_t>(view.camera_idx);
      for (std::size_t i = 0; i < shown.size(); ++i) {
        with[first + i % 3] += static_cast<double>(shown[i]) * view.pixels->colors[i];
        own[first + i % 3] += static_cast<double>(shown[i]) * shown[i];
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      double log_sum = 0;
      int known = 0;
      for (std::size_t i = c; i < with.size(); i += 3) {
        if (with[i] > 0 && own[i] > 0) {
          log_sum += std::log(with[i] / own[i]);
          ++known;
        }
      }
      const double middle = known > 0 ? std::exp(log_sum / known) : 1;
      for (std::size_t i = c; i < with.size(); i += 3) {
        result.gain[i] =
            with[i] > 0 && own[i] > 0 ? static_cast<float>(with[i] / own[i] / middle) : 1.0F;
      }
    }
  }
  return result;
}

}  // namespace atelier

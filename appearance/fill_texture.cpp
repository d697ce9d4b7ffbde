#include "appearance/fill_texture.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/error.h"

namespace atelier {
namespace {

using Color = std::array<float, 3>;

/// The texels of the surface beside one, -1 where it ends.
std::array<int, 4> beside(const TexelMap& map, int texel) {
  const int size = map.resolution;
  const int x = texel % size;
  const int y = texel / size;
  std::array<int, 4> result = {x > 0 ? texel - 1 : -1, x + 1 < size ? texel + 1 : -1,
                               y > 0 ? texel - size : -1, y + 1 < size ? texel + size : -1};
  for (int& next : result) {
    if (next >= 0 && map.face.data[static_cast<std::size_t>(next)] < 0) {
      const int source = map.source[static_cast<std::size_t>(next)];
      next = map.face.data[static_cast<std::size_t>(source)] >= 0 ? source : -1;
    }
  }
  return result;
}

}  // namespace

void fill_unseen(StaticTexture& texture, const TexelMap& map) {
  ATELIER_CHECK(texture.texture.width == map.resolution && texture.seen.width == map.resolution,
                "the texture is of another resolution than the map");
  std::vector<char> known(texture.seen.data.begin(), texture.seen.data.end());
  const auto color = [&](int texel) {
    return &texture.texture.data[3 * static_cast<std::size_t>(texel)];
  };
  Color mean{};
  std::size_t seen = 0;
  std::vector<int> unknown;
  for (const int texel : map.covered) {
    if (known[static_cast<std::size_t>(texel)] == 0) {
      unknown.push_back(texel);
      continue;
    }
    ++seen;
    for (std::size_t c = 0; c < 3; ++c) {
      mean[c] += (color(texel)[c] - mean[c]) / static_cast<float>(seen);
    }
  }
  // One ring of texels a round.
  while (!unknown.empty()) {
    std::vector<std::pair<int, Color>> found;
    std::vector<int> rest;
    for (const int texel : unknown) {
      Color sum{};
      float count = 0;
      for (const int next : beside(map, texel)) {
        if (next >= 0 && known[static_cast<std::size_t>(next)] != 0) {
          ++count;
          for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += color(next)[c];
          }
        }
      }
      if (count > 0) {
        found.push_back({texel, {sum[0] / count, sum[1] / count, sum[2] / count}});
      } else {
        rest.push_back(texel);
      }
    }
    if (found.empty()) {
      for (const int texel : unknown) {
        found.push_back({texel, mean});
      }
      rest.clear();
    }
    for (const auto& [texel, value] : found) {
      std::copy(value.begin(), value.end(), color(texel));
      known[static_cast<std::size_t>(texel)] = 1;
    }
    unknown = std::move(rest);
  }
  for (std::size_t i = 0; i < map.source.size(); ++i) {
    if (map.source[i] != static_cast<int>(i)) {
      std::copy_n(color(map.source[i]), 3, color(static_cast<int>(i)));
    }
  }
}

}  // namespace atelier

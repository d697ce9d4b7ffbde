#include "appearance/mean_texture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "appearance/blank_model.h"
#include "appearance/fill_texture.h"
#include "appearance/texel_map.h"
#include "core/error.h"

namespace atelier {
namespace {

constexpr int kGeometrySide = 256;  // texels of the maps of normals and positions
constexpr int kShadowChannels = 2;  // one for more light than the mean, one for less

NetworkOptions mean_texture_options(int resolution) {
  NetworkOptions options;
  options.resolution = resolution;
  options.channels = kShadowChannels;
  options.view_independent = false;
  options.view_dependent = false;
  options.shadow = true;
  options.shading = 1;
  options.transfer_degree = 0;
  return options;
}

/// A 3x3 convolution [to,from] that looks at its own texel alone.
void put_pointwise(AppearanceModel& model, const std::string& name,
                   const std::vector<std::vector<float>>& rows, float bias) {
  const auto to = static_cast<std::int64_t>(rows.size());
  const auto from = static_cast<std::int64_t>(rows[0].size());
  std::vector<float> v(static_cast<std::size_t>(to * from * 9), 0.0F);
  std::vector<float> g;
  for (std::size_t o = 0; o < rows.size(); ++o) {
    float square = 0;
    for (std::size_t i = 0; i < rows[o].size(); ++i) {
      v[(o * rows[o].size() + i) * 9 + 4] = rows[o][i];
      square += rows[o][i] * rows[o][i];
    }
    g.push_back(std::sqrt(square));
  }
  model.parameters[name + ".v"] = tensor_of(v, {to, from, 3, 3});
  model.parameters[name + ".g"] = tensor_of(g, {to, 1, 1, 1});
  model.parameters[name + ".b"] = tensor_of(std::vector<float>(rows.size(), bias), {to});
}

/// The shadow network whose output is sigmoid(3 + darkening x): x and -x go through two leaky
/// rectifiers of slope 0.2 each, whose difference is 1.04 x again.
void put_shadow(AppearanceModel& model, float darkening) {
  constexpr float kThrough = 1.04F;
  const float weight = std::max(darkening, 1e-6F) / kThrough;  // 0 has no direction
  put_pointwise(model, "shadow.first", {{1}, {-1}}, 0);
  put_pointwise(model, "shadow.middle", {{1, 0}, {0, 1}}, 0);
  put_pointwise(model, "shadow.last", {{weight, -weight}}, kOpenShadow);
}

/// Without the pixels that do not count.
TexturePixels counted(const TexturePixels& all) {
  TexturePixels kept;
  for (std::size_t p = 0; p < all.u.size(); ++p) {
    if (all.weights[p] > 0) {
      kept.u.push_back(all.u[p]);
      kept.v.push_back(all.v[p]);
      kept.weights.push_back(all.weights[p]);
      kept.colors.insert(kept.colors.end(), all.colors.begin() + static_cast<std::ptrdiff_t>(3 * p),
                         all.colors.begin() + static_cast<std::ptrdiff_t>(3 * p + 3));
    }
  }
  return kept;
}

}  // namespace

OptionTable describe(MeanTextureOptions& options) {
  return OptionTable()
      .add("max_angle", options.max_angle, 10, 90, "degrees",
           "Maximum angle between normal and view of pixels that count for the mean texture")
      .add("darkening", options.darkening, 0, 100, "",
           "Slope by which ambient occlusion beyond the mean darkens the mean texture; 0: none");
}

std::vector<std::vector<float>> angle_weights(const AppearanceData& data,
                                              const MeanTextureOptions& options) {
  const TexelMap map = texel_map(data.faces, data.uvs, data.uv_faces, kGeometrySide);
  const double least = std::cos(options.max_angle * std::numbers::pi / 180);
  std::vector<std::vector<float>> all;
  for (const AppearanceView& view : data.views) {
    const SurfaceFrame& frame = data.frames.at(static_cast<std::size_t>(view.frame_idx));
    const TexturePixels places{view.u, view.v, {}};
    const auto sampled = [&](const FloatRows& rows) {
      return sample_texture(texture_of(map, texel_values(map, data.faces, rows)), places);
    };
    const std::vector<float> normal = sampled(frame.normal);
    const std::vector<float> position = sampled(frame.position);
    const Eigen::Vector3d center = data.centers.row(view.camera_idx).transpose();
    std::vector<float>& weights = all.emplace_back();
    for (std::size_t p = 0; p < view.u.size(); ++p) {
      const auto at = [&](const std::vector<float>& values) {
        return Eigen::Vector3d(values[3 * p], values[3 * p + 1], values[3 * p + 2]);
      };
      const double along = at(normal).normalized().dot((center - at(position)).normalized());
      weights.push_back(along > least ? static_cast<float>(along * along) : 0.0F);
    }
  }
  return all;
}

AppearanceData without_pixels(
    AppearanceData data, const std::function<std::vector<char>(const AppearanceView& view)>& left) {
  std::vector<AppearanceView> views;
  for (const AppearanceView& all : data.views) {
    const std::vector<char> out = left(all);
    AppearanceView kept;
    kept.camera_idx = all.camera_idx;
    kept.frame_idx = all.frame_idx;
    for (std::size_t p = 0; p < all.pixel.size(); ++p) {
      if (out[p] == 0) {
        kept.pixel.push_back(all.pixel[p]);
        kept.u.push_back(all.u[p]);
        kept.v.push_back(all.v[p]);
        const auto first = all.colors.begin() + static_cast<std::ptrdiff_t>(3 * p);
        kept.colors.insert(kept.colors.end(), first, first + 3);
      }
    }
    if (!kept.pixel.empty()) {
      views.push_back(std::move(kept));
    }
  }
  data.views = std::move(views);
  return data;
}

AppearanceData without_grazing(AppearanceData data, const MeanTextureOptions& options) {
  const std::vector<std::vector<float>> weights = angle_weights(data, options);
  std::size_t view = 0;
  return without_pixels(std::move(data), [&](const AppearanceView& all) {
    std::vector<char> out(all.pixel.size(), 0);
    for (std::size_t p = 0; p < out.size(); ++p) {
      out[p] = weights[view][p] > 0 ? 0 : 1;
    }
    ++view;
    return out;
  });
}

AppearanceModel mean_texture_model(const AppearanceData& data, int resolution,
                                   const MeanTextureOptions& options, double smoothness) {
  AppearanceModel model = blank_model(data, mean_texture_options(resolution));
  std::vector<TexturePixels> pixels;
  pixels.reserve(data.views.size());
  std::vector<TextureView> views;
  std::vector<std::vector<float>> weights = angle_weights(data, options);
  for (std::size_t i = 0; i < data.views.size(); ++i) {
    TexturePixels all = texture_pixels(data.views[i]);
    all.weights = std::move(weights[i]);
    pixels.push_back(counted(all));
    views.push_back({data.views[i].camera_idx, &pixels.back()});
  }
  constexpr int kRounds = 6;
  StaticTexture fixed = static_texture(resolution, static_cast<int>(data.camera_ids.size()), views,
                                       kRounds, smoothness);
  fill_unseen(fixed, texel_map(data.faces, data.uvs, data.uv_faces, resolution));
  put_shadow(model, static_cast<float>(options.darkening));
  put_static_texture(model, std::move(fixed));
  return model;
}

double seen_share(const AppearanceData& data, int resolution) {
  const TexelMap map = texel_map(data.faces, data.uvs, data.uv_faces, resolution);
  std::vector<char> seen(map.source.size(), 0);
  for (const AppearanceView& view : data.views) {
    for (std::size_t p = 0; p < view.u.size(); ++p) {
      for (const int texel : texture_taps(resolution, view.u[p], view.v[p]).texel) {
        seen[static_cast<std::size_t>(texel)] = 1;
      }
    }
  }
  const auto count = std::count_if(map.covered.begin(), map.covered.end(), [&](int texel) {
    return seen[static_cast<std::size_t>(texel)] != 0;
  });
  return map.covered.empty() ? 0
                             : static_cast<double>(count) / static_cast<double>(map.covered.size());
}

}  // namespace atelier

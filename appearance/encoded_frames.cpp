#include "appearance/encoded_frames.h"

#include <algorithm>

#include "appearance/texel_map.h"

namespace atelier {
namespace {

constexpr std::size_t kResidual = 4;  // first of its channels
constexpr std::size_t kSeen = 7;

/// Offsets and their support, where there are any.
Image shape_image(const AppearanceData& data, const TexelMap& map, std::size_t frame) {
  constexpr float kCentimetre = 100;
  if (!data.body) {
    return {map.resolution, map.resolution, 4};
  }
  Eigen::MatrixXf rows(data.body->offset[frame].rows(), 4);
  rows << kCentimetre * data.body->offset[frame], data.body->support[frame];
  return texture_of(map, texel_values(map, data.faces, rows));
}

/// Adds what a view's pixels are more than the static texture.
void add_residual(Image& sum, const AppearanceView& view, const AppearanceModel& model) {
  constexpr float kDark = 0.02F;  // below this a share says nothing
  const TexturePixels pixels = texture_pixels(view);
  const std::vector<float> still = sample_texture(model.static_texture, pixels);
  const float* gain = &model.static_gain[3 * static_cast<std::size_t>(view.camera_idx)];
  const auto side = static_cast<std::size_t>(sum.width);
  const auto cell = [&](float share) {
    return std::min(side - 1, static_cast<std::size_t>(share * static_cast<float>(side)));
  };
  for (std::size_t i = 0; i < pixels.u.size(); ++i) {
    float* texel = &sum.data[kEncodedChannels * (cell(1 - pixels.v[i]) * side + cell(pixels.u[i]))];
    for (std::size_t c = 0; c < 3; ++c) {
      const float share = pixels.colors[3 * i + c] / (gain[c] * std::max(kDark, still[3 * i + c]));
      texel[kResidual + c] += std::clamp(share - 1, -1.0F, 1.0F);
    }
    texel[kSeen] += 1;
  }
}

}  // namespace

std::vector<Image> encoded_frames(const AppearanceData& data, const AppearanceModel& model) {
  constexpr int kReach = 4;
  const int side = code_resolution_of(model.options);
  const TexelMap map = texel_map(data.faces, data.uvs, data.uv_faces, side, kReach);
  std::vector<Image> all(data.frames.size(), Image(side, side, kEncodedChannels));
  for (const AppearanceView& view : data.views) {
    if (!view.colors.empty()) {
      add_residual(all[static_cast<std::size_t>(view.frame_idx)], view, model);
    }
  }
  for (std::size_t f = 0; f < all.size(); ++f) {
    const Image shape = shape_image(data, map, f);
    for (std::size_t i = 0; i < all[f].data.size() / kEncodedChannels; ++i) {
      float* texel = &all[f].data[kEncodedChannels * i];
      std::copy_n(&shape.data[4 * i], 4, texel);
      for (std::size_t c = 0; c < 3 && texel[kSeen] > 0; ++c) {
        texel[kResidual + c] /= texel[kSeen];
      }
      texel[kSeen] = std::min(texel[kSeen], 1.0F);
    }
  }
  return all;
}

}  // namespace atelier

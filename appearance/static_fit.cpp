#include "appearance/static_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "appearance/psnr.h"
#include "appearance/texture_sampling.h"
#include "core/io/srgb.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// Of those that are numbers; 0 of none.
double median(std::vector<double> values) {
  std::erase_if(values, [](double value) { return std::isnan(value); });
  if (values.empty()) {
    return 0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

StaticFit static_fit(const AppearanceData& data, int resolution) {
  std::vector<TexturePixels> pixels;
  pixels.reserve(data.views.size());
  std::vector<TextureView> views;
  for (const AppearanceView& view : data.views) {
    pixels.push_back(texture_pixels(view));
    views.push_back({view.camera_idx, &pixels.back()});
  }
  const std::size_t cameras = data.camera_ids.size();
  const StaticTexture fixed = static_texture(resolution, static_cast<int>(cameras), views);
  std::vector<double> squares(cameras, 0.0);
  std::vector<double> count(cameras, 0.0);
  std::vector<Eigen::Array3d> sum(cameras, Eigen::Array3d::Zero());
  std::vector<double> power(cameras, 0.0);
  for (const TextureView& view : views) {
    const auto camera = static_cast<std::size_t>(view.camera_idx);
    const std::vector<float> shown = sample_texture(fixed.texture, *view.pixels);
    for (std::size_t i = 0; i < shown.size(); ++i) {
      const float light = std::clamp(shown[i] * fixed.gain[3 * camera + i % 3], 0.0F, 1.0F);
      const double taken = srgb_from_linear(view.pixels->colors[i]);
      const double off = srgb_from_linear(light) - taken;
      squares[camera] += off * off;
      count[camera] += 1;
      sum[camera][static_cast<Index>(i % 3)] += taken;
      power[camera] += taken * taken;
    }
  }
  StaticFit fit;
  double all_squares = 0;
  double all_count = 0;
  const auto seeing = static_cast<double>(
      std::count_if(count.begin(), count.end(), [](double of) { return of > 0; }));
  for (std::size_t c = 0; c < cameras; ++c) {
    fit.camera_psnr.push_back(psnr_of(squares[c] / count[c]));
    // Of each channel about its own mean.
    const double variance = power[c] - 3 * sum[c].square().sum() / std::max(count[c], 1.0);
    const double explained = variance > 0 ? 1 - squares[c] / variance : 0;
    fit.camera_explained.push_back(seeing > 1 ? (explained - 1 / seeing) / (1 - 1 / seeing)
                                              : explained);
    all_squares += squares[c];
    all_count += count[c];
  }
  fit.psnr = psnr_of(all_squares / all_count);
  return fit;
}

int judged_texels(const AppearanceData& data) {
  constexpr double kPixels = 32;
  constexpr int kFewest = 16;
  double pixels = 0;
  for (const AppearanceView& view : data.views) {
    pixels += static_cast<double>(view.pixel.size());
  }
  const double side = std::sqrt(pixels / kPixels);
  return saturating_cast<int>(std::clamp<double>(side, kFewest, kJudgedTexels));
}

std::vector<std::size_t> contradicting_cameras(const StaticFit& fit) {
  constexpr double kShare = 0.25;
  constexpr double kTells = 0.1;  // explained of the median camera: less says nothing of others
  constexpr double kWorse = 4;    // dB
  const double explained = median(fit.camera_explained);
  const double psnr = median(fit.camera_psnr);
  std::vector<std::size_t> cameras;
  for (std::size_t c = 0; c < fit.camera_psnr.size(); ++c) {
    if (std::isnan(fit.camera_psnr[c])) {
      continue;
    }
    const bool strange = explained > kTells && fit.camera_explained[c] < kShare * explained;
    if (strange || fit.camera_psnr[c] < psnr - kWorse) {
      cameras.push_back(c);
    }
  }
  return cameras;
}

bool max_contradict(const StaticFit& fit) {
  constexpr double kLeast = 20;  // dB
  constexpr double kShare = 0.1;
  std::size_t judged = 0;
  std::size_t strange = 0;
  for (std::size_t c = 0; c < fit.camera_psnr.size(); ++c) {
    if (!std::isnan(fit.camera_psnr[c])) {
      ++judged;
      strange += fit.camera_psnr[c] < kLeast && fit.camera_explained[c] < kShare ? 1 : 0;
    }
  }
  return 2 * strange > judged;
}

}  // namespace atelier

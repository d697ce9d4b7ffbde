#include "capture/surface/color_samples.h"

#include <optional>

#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// Between four pixels; nothing within a pixel of the border.
std::optional<Eigen::Vector3d> color_at(const Image& image, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() - 0.5;
  const double y = pixel.y() - 0.5;
  if (!(x >= 1 && y >= 1 && x < image.width - 2 && y < image.height - 2)) {
    return std::nullopt;
  }
  const int x0 = saturating_cast<int>(x);
  const int y0 = saturating_cast<int>(y);
  Eigen::Vector3d color;
  for (int c = 0; c < 3; ++c) {
    const double top =
        image.at(x0, y0, c) + (x - x0) * (image.at(x0 + 1, y0, c) - image.at(x0, y0, c));
    const double low = image.at(x0, y0 + 1, c) +
                       (x - x0) * (image.at(x0 + 1, y0 + 1, c) - image.at(x0, y0 + 1, c));
    color[c] = top + (y - y0) * (low - top);
  }
  return color;
}

}  // namespace

std::vector<ColorSample> color_samples(const CoarseReconstruction& scan) {
  std::vector<ColorSample> samples;
  for (std::size_t p = 0; p < scan.places.size(); ++p) {
    const SeenPlace& place = scan.places[p];
    for (const int index : place.views) {
      const InstantView& view = scan.views[static_cast<std::size_t>(index)];
      const auto pixel = project(view.camera, place.point);
      const auto color = pixel ? color_at(view.image, *pixel) : std::nullopt;
      if (color) {
        const double cosine =
            (camera_center(view.camera) - place.point).normalized().dot(place.normal);
        samples.push_back({index, static_cast<int>(p), *color, cosine});
      }
    }
  }
  return samples;
}

std::vector<ColorSample> color_samples(const std::vector<InstantView>& views,
                                       const ReconstructOptions& reconstruct,
                                       const CoarseReconstructionOptions& options, Device device) {
  return color_samples(coarse_reconstruction(views, reconstruct, options, device));
}

}  // namespace atelier

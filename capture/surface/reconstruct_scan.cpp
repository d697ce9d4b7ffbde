#include "capture/surface/reconstruct_scan.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "capture/stereo/choose_sources.h"
#include "capture/stereo/undistort.h"
#include "core/error.h"

namespace atelier {
namespace {

/// A view without distortion and gain.
struct StraightView {
  Camera camera;
  Image image;
  ByteImage mask;
  ByteImage labels;
};

StraightView straightened(const InstantView& view) {
  StraightView straight;
  straight.camera = without_distortion(view.camera);
  straight.image = undistorted(view.camera, view.image);
  for (std::size_t i = 0; i < straight.image.data.size(); ++i) {
    straight.image.data[i] /= static_cast<float>(view.camera.gain(static_cast<Index>(i % 3)));
  }
  straight.mask = undistorted(view.camera, view.mask);
  if (!view.labels.data.empty()) {
    straight.labels = undistorted(view.camera, view.labels);
  }
  return straight;
}

/// One channel, gamma-coded: noise is then nearly even over brightness.
Image stereo_image(const Image& image) {
  Image value(image.width, image.height, 1);
  for (std::size_t p = 0; p < value.data.size(); ++p) {
    const float luminance =
        0.3f * image.data[3 * p] + 0.6f * image.data[3 * p + 1] + 0.1f * image.data[3 * p + 2];
    value.data[p] = std::pow(std::clamp(luminance, 0.0f, 1.0f), 1 / 2.2f);
  }
  return value;
}

bool is_black(const Image& image) {
  constexpr float kBlack = 0.002f;
  return std::none_of(image.data.begin(), image.data.end(),
                      [](float value) { return value > kBlack; });
}

std::vector<StraightView> usable_views(const std::vector<InstantView>& views,
                                       std::vector<Finding>& findings) {
  std::vector<StraightView> usable;
  for (const InstantView& view : views) {
    ATELIER_CHECK(view.image.width == view.camera.width &&
                      view.image.height == view.camera.height && view.image.channels == 3,
                  "an image of another size than its camera's");
    if (is_black(view.image)) {
      findings.push_back({Severity::Warning, "view-black", view.camera.id, "the image is black",
                          "it is left out"});
      continue;
    }
    if (std::none_of(view.mask.data.begin(), view.mask.data.end(),
                     [](std::uint8_t pixel) { return pixel != 0; })) {
      findings.push_back({Severity::Warning, "view-mask-empty", view.camera.id,
                          "the mask shows no subject", "it is left out"});
      continue;
    }
    usable.push_back(straightened(view));
  }
  return usable;
}

}  // namespace

OptionTable describe(ReconstructOptions& options) {
  OptionTable table;
  table.add("hull", describe(options.hull));
  table.add("stereo", describe(options.stereo));
  table.add("fuse", describe(options.fuse));
  table.add("surface", describe(options.surface));
  table.add("labels", describe(options.labels));
  return table;
}

ReconstructedScan reconstruct_scan(const std::vector<InstantView>& views,
                                   const ReconstructOptions& options, Device device) {
  ReconstructedScan result;
  const std::vector<StraightView> usable = usable_views(views, result.findings);
  if (usable.size() < 2) {
    throw DataError("", "views", std::to_string(usable.size()) + " with a subject in them",
                    "at least two");
  }
  std::vector<Camera> cameras;
  std::vector<ByteImage> masks;
  std::vector<Image> images;
  for (const StraightView& view : usable) {
    cameras.push_back(view.camera);
    masks.push_back(view.mask);
    images.push_back(view.image);
  }
  const VisualHull hull = visual_hull(cameras, masks, options.hull);
  const auto sources = choose_sources(cameras, looked_at(cameras), options.stereo.sources);
  std::vector<StereoView> stereo_views;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    DepthBounds bounds = depth_bounds(hull, cameras[i], masks[i]);
    stereo_views.push_back({cameras[i], stereo_image(images[i]), std::move(bounds.near_depth),
                            std::move(bounds.far_depth), sources[i]});
  }
  result.maps = stereo(stereo_views, options.stereo, device);
  result.points = without_outliers(fuse(result.maps, images, options.fuse), options.surface);
  result.scan = surface_from_points(result.points, options.surface);
  std::vector<LabelView> label_views;
  for (const StraightView& view : usable) {
    if (!view.labels.data.empty()) {
      label_views.push_back({view.camera, view.labels});
    }
  }
  result.scan.labels = smooth_labels(
      result.scan, label_votes(result.scan, label_views, options.labels), options.labels);
  return result;
}

}  // namespace atelier

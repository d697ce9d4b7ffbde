#include "capture/surface/coarse_reconstruction.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "capture/surface/geometric_consistency.h"
#include "core/error.h"

namespace atelier {
namespace {

/// A view with every `factor` x `factor` pixels made one.
InstantView shrunk(const InstantView& view, int factor) {
  if (factor <= 1) {
    return view;
  }
  InstantView small;
  small.camera = view.camera;
  const int width = view.image.width / factor;
  const int height = view.image.height / factor;
  small.camera.width = width;
  small.camera.height = height;
  small.camera.fx /= factor;
  small.camera.fy /= factor;
  small.camera.cx /= factor;
  small.camera.cy /= factor;
  small.image = Image(width, height, 3);
  const bool masked = !view.mask.data.empty();
  small.mask = masked ? ByteImage(width, height, 1) : ByteImage{};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        float sum = 0;
        for (int dy = 0; dy < factor; ++dy) {
          for (int dx = 0; dx < factor; ++dx) {
            sum += view.image.at(factor * x + dx, factor * y + dy, c);
          }
        }
        small.image.at(x, y, c) = sum / static_cast<float>(factor * factor);
      }
      if (masked) {
        small.mask.at(x, y) = view.mask.at(factor * x + factor / 2, factor * y + factor / 2);
      }
    }
  }
  return small;
}

/// True if the map has the place there and on all sides.
bool has_place(const DepthMap& map, const Eigen::Vector3d& place, double error) {
  const auto pixel = project(map.camera, place);
  if (!pixel) {
    return false;
  }
  const double depth = camera_from_world(map.camera, place).z();
  const int x = static_cast<int>(pixel->x());
  const int y = static_cast<int>(pixel->y());
  if (x < 1 || y < 1 || x + 1 >= map.depth.width || y + 1 >= map.depth.height) {
    return false;
  }
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      // Neighbours may slope away, and must not be another surface.
      const double allowed = (dx == 0 && dy == 0 ? 1 : 4) * error * depth;
      if (!(std::abs(static_cast<double>(map.depth.at(x + dx, y + dy)) - depth) < allowed)) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace

OptionTable describe(CoarseReconstructionOptions& options) {
  OptionTable table;
  table.add("longest_side", options.longest_side, 64, 4096, "px",
            "Longer side of the downscaled images that stereo works on; larger takes longer");
  table.add("max_view_angle", options.max_view_angle, 0.1, 1.5, "rad",
            "Maximum angle between surface normal and view direction at which a view is sampled");
  table.add("depth_error", options.depth_error, 1e-4, 0.2, "",
            "Maximum relative difference between a point's depth and the view's own depth map");
  table.add("max_points", options.max_points, 100, 1000000, "",
            "Maximum number of points of one instant");
  return table;
}

CoarseReconstruction coarse_reconstruction(const std::vector<InstantView>& views,
                                           const ReconstructOptions& reconstruct,
                                           const CoarseReconstructionOptions& options,
                                           Device device) {
  CoarseReconstruction result;
  for (const InstantView& view : views) {
    const auto is_like = [&](const auto& image) {
      return image.width == view.camera.width && image.height == view.camera.height;
    };
    ATELIER_CHECK(is_like(view.image) && (view.mask.data.empty() || is_like(view.mask)),
                  "an image or mask of another size than its camera's");
    const int side = std::max(view.image.width, view.image.height);
    result.views.push_back(shrunk(view, (side + options.longest_side - 1) / options.longest_side));
    result.views.back().camera.gain.setOnes();
  }
  ReconstructOptions blind = reconstruct;
  blind.stereo.level_weight = 0;
  const StraightInstant instant = straight_instant(result.views, blind);
  const ConsistentPoints scan =
      consistent_points(instant, instant_depths(instant, blind, device), blind);
  std::vector<int> view_of_map;
  for (const DepthMap& map : scan.maps) {
    const auto found =
        std::find_if(result.views.begin(), result.views.end(),
                     [&](const InstantView& view) { return view.camera.id == map.camera.id; });
    ATELIER_CHECK(found != result.views.end(), "a depth map of no view");
    view_of_map.push_back(static_cast<int>(found - result.views.begin()));
  }
  const Index count = scan.points.vertices.rows();
  const Index step = std::max<Index>(1, count / options.max_points);
  for (Index p = 0; p < count; p += step) {
    SeenPlace place;
    place.point = scan.points.vertices.row(p).transpose();
    place.normal = scan.points.normals.row(p).transpose();
    for (std::size_t m = 0; m < scan.maps.size(); ++m) {
      const double cosine =
          (camera_center(scan.maps[m].camera) - place.point).normalized().dot(place.normal);
      if (cosine >= std::cos(options.max_view_angle) &&
          has_place(scan.maps[m], place.point, options.depth_error)) {
        place.views.push_back(view_of_map[m]);
      }
    }
    result.places.push_back(std::move(place));
  }
  return result;
}

}  // namespace atelier

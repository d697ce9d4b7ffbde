#include "capture/stereo/undistort.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// Calls `put(x, y, pixel)` for every pixel of the straight camera that the bent one has.
template <class Put>
void for_each_pixel(const Camera& camera, const Put& put) {
  const Camera straight = without_distortion(camera);
  const Eigen::Matrix3d world_from_camera = camera.camera_from_world_rotation.transpose();
  const Eigen::Vector3d centre = camera_center(camera);
  parallel_for(camera.height, 8, [&](Index begin, Index end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < camera.width; ++x) {
        const Eigen::Vector3d ray((x + 0.5 - straight.cx) / straight.fx,
                                  (y + 0.5 - straight.cy) / straight.fy, 1);
        const auto pixel = project(camera, centre + world_from_camera * ray);
        if (pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < camera.width &&
            pixel->y() < camera.height) {
          put(x, y, *pixel);
        }
      }
    }
  });
}

}  // namespace

Camera without_distortion(const Camera& camera) {
  Camera straight = camera;
  straight.distortion_model = Distortion::None;
  straight.distortion = {};
  return straight;
}

Image undistorted(const Camera& camera, const Image& image) {
  ATELIER_CHECK(image.width == camera.width && image.height == camera.height,
                "an image of another size than its camera's");
  Image result(image.width, image.height, image.channels);
  for_each_pixel(camera, [&](int x, int y, const Eigen::Vector2d& pixel) {
    const double left = std::clamp(pixel.x() - 0.5, 0.0, image.width - 1.0);
    const double top = std::clamp(pixel.y() - 0.5, 0.0, image.height - 1.0);
    const int x0 = saturating_cast<int>(left);
    const int y0 = saturating_cast<int>(top);
    const int x1 = std::min(x0 + 1, image.width - 1);
    const int y1 = std::min(y0 + 1, image.height - 1);
    const auto u = static_cast<float>(left - x0);
    const auto v = static_cast<float>(top - y0);
    for (int c = 0; c < image.channels; ++c) {
      const float above = (1 - u) * image.at(x0, y0, c) + u * image.at(x1, y0, c);
      const float below = (1 - u) * image.at(x0, y1, c) + u * image.at(x1, y1, c);
      result.at(x, y, c) = (1 - v) * above + v * below;
    }
  });
  return result;
}

ByteImage undistorted(const Camera& camera, const ByteImage& image) {
  ATELIER_CHECK(image.width == camera.width && image.height == camera.height,
                "an image of another size than its camera's");
  ByteImage result(image.width, image.height, image.channels);
  for_each_pixel(camera, [&](int x, int y, const Eigen::Vector2d& pixel) {
    for (int c = 0; c < image.channels; ++c) {
      result.at(x, y, c) =
          image.at(saturating_cast<int>(pixel.x()), saturating_cast<int>(pixel.y()), c);
    }
  });
  return result;
}

}  // namespace atelier

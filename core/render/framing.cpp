#include "core/render/framing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"

namespace atelier {

namespace {

// Rows: right, down, forward of a camera that looks at the subject from `view`.
Eigen::Matrix3d orientation(const View& view) {
  const double elevation = std::clamp(view.elevation, -1.55, 1.55);  // straight down has no "up"
  const Eigen::Vector3d to_viewer(std::cos(elevation) * std::sin(view.azimuth), std::sin(elevation),
                                  std::cos(elevation) * std::cos(view.azimuth));
  const Eigen::Vector3d forward = -to_viewer;
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rows;
  rows.row(0) = right;
  rows.row(1) = forward.cross(right);
  rows.row(2) = forward;
  return rows;
}

Camera lens(int width, int height, const FramingOptions& options) {
  ATELIER_CHECK(width > 0 && height > 0, "an image needs a positive size");
  ATELIER_CHECK(options.field_of_view > 0 && options.field_of_view < 3,
                "field_of_view must lie in (0, 3)");
  ATELIER_CHECK(options.margin >= 0 && options.margin <= 0.45, "margin must lie in [0, 0.45]");
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.5 * std::max(width, height) / std::tan(0.5 * options.field_of_view);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

// Distance from the target at which every point just fits.
double fitting_distance(const Points& points, const Eigen::Vector3d& target,
                        const Eigen::Matrix3d& rows, const Camera& camera, double margin) {
  const double tan_x = camera.cx * (1 - 2 * margin) / camera.fx;
  const double tan_y = camera.cy * (1 - 2 * margin) / camera.fy;
  double distance = 1e-3;
  for (Index i = 0; i < points.rows(); ++i) {
    const Eigen::Vector3d q = rows * (points.row(i).transpose() - target);
    distance = std::max(
        {distance, std::abs(q.x()) / tan_x - q.z(), std::abs(q.y()) / tan_y - q.z(), 1e-3 - q.z()});
  }
  return distance;
}

Eigen::Vector3d middle(const Points& points) {
  ATELIER_CHECK(points.rows() > 0, "framing needs at least one point");
  const Eigen::Vector3d low = points.colwise().minCoeff();
  const Eigen::Vector3d high = points.colwise().maxCoeff();
  ATELIER_CHECK(low.allFinite() && high.allFinite(), "framing needs finite points");
  return 0.5 * (low + high);
}

void place(Camera& camera, const Eigen::Matrix3d& rows, const Eigen::Vector3d& target,
           double distance) {
  camera.camera_from_world_rotation = rows;
  camera.camera_from_world_translation = -rows * target + Eigen::Vector3d(0, 0, distance);
}

}  // namespace

View turned(const View& view, const Eigen::Vector3d& facing) {
  return {view.azimuth + std::atan2(facing.x(), facing.z()), view.elevation};
}

Camera camera_around(const Points& points, const View& view, int width, int height,
                     const FramingOptions& options) {
  Camera camera = lens(width, height, options);
  const Eigen::Vector3d target = middle(points);
  const Eigen::Matrix3d rows = orientation(view);
  place(camera, rows, target, fitting_distance(points, target, rows, camera, options.margin));
  return camera;
}

std::vector<Camera> turntable_cameras(const Points& points, const View& start, int count, int width,
                                      int height, const FramingOptions& options) {
  ATELIER_CHECK(count > 0, "a turntable needs at least one image");
  const Eigen::Vector3d target = middle(points);
  std::vector<Camera> cameras(static_cast<std::size_t>(count), lens(width, height, options));
  std::vector<Eigen::Matrix3d> rows;
  double distance = 0;
  for (int i = 0; i < count; ++i) {
    const double turn = 2 * std::numbers::pi * i / count;
    rows.push_back(orientation({start.azimuth + turn, start.elevation}));
    distance = std::max(
        distance, fitting_distance(points, target, rows.back(), cameras.front(), options.margin));
  }
  for (int i = 0; i < count; ++i) {
    place(cameras[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(i)], target,
          distance);
    cameras[static_cast<std::size_t>(i)].id = "turn" + std::to_string(i);
  }
  return cameras;
}

}  // namespace atelier

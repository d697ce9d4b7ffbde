#include "core/render/studio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/render/tone.h"

namespace atelier {

namespace {

constexpr double kMinExtent = 1e-5;  // metres; the lights in proportion would have no area

Points all_vertices(const std::vector<RenderMesh>& meshes) {
  Index count = 0;
  for (const RenderMesh& m : meshes) {
    count += m.mesh.vertices.rows();
  }
  Points points(count, 3);
  Index row = 0;
  for (const RenderMesh& m : meshes) {
    points.middleRows(row, m.mesh.vertices.rows()) = m.mesh.vertices;
    row += m.mesh.vertices.rows();
  }
  return points;
}

// A user's mesh may lack normals or faces; an empty list is the empty studio.
void check_subject(const std::vector<RenderMesh>& meshes, const Points& points) {
  if (meshes.empty()) {
    return;
  }
  const auto has_faces = [](const RenderMesh& m) { return m.mesh.faces.rows() > 0; };
  if (std::none_of(meshes.begin(), meshes.end(), has_faces)) {
    throw DataError("", "", "the mesh has no faces", "triangles to show");
  }
  if (points.rows() == 0) {
    return;  // faces without vertices: check_scene names them
  }
  const Eigen::RowVector3d extent = points.colwise().maxCoeff() - points.colwise().minCoeff();
  if (extent.norm() <= kMinExtent) {
    throw DataError("", "", "the mesh has no extent", "vertices more than 10 micrometres apart");
  }
}

// A rectangle at `from` that shines at `at`.
AreaLight softbox(const Eigen::Vector3d& from, const Eigen::Vector3d& at, double half_width,
                  double half_height, const Eigen::Vector3f& radiance) {
  const Eigen::Vector3d forward = (at - from).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  const Eigen::Vector3d up = right.cross(forward);
  AreaLight light;
  light.center = from;
  light.half_u = half_width * right;
  light.half_v = -half_height * up;
  light.radiance = radiance;
  return light;
}

}  // namespace

Scene studio_scene(std::vector<RenderMesh> meshes, double azimuth) {
  ATELIER_CHECK(std::isfinite(azimuth), "azimuth must be finite");
  Eigen::Vector3d low(-0.5, 0, -0.5);
  Eigen::Vector3d high(0.5, 1.8, 0.5);
  const Points points = all_vertices(meshes);
  check_subject(meshes, points);
  if (points.rows() > 0) {
    low = points.colwise().minCoeff();
    high = points.colwise().maxCoeff();
  }
  const Eigen::Vector3d middle = 0.5 * (low + high);
  // Wide subjects (a table of patterns, a shoe) are lit as their width asks.
  const double size = 0.5 * (high - low).norm();

  Scene scene;
  scene.meshes = std::move(meshes);
  scene.ground = Ground{low.y(), {0.55f, 0.54f, 0.53f}, true};
  scene.background.top = {0.30f, 0.32f, 0.345f};
  scene.background.bottom = {0.52f, 0.52f, 0.52f};
  scene.environment.zenith = {0.34f, 0.36f, 0.40f};
  scene.environment.horizon = {0.22f, 0.23f, 0.25f};
  scene.environment.nadir = {0.20f, 0.20f, 0.20f};
  const Eigen::AngleAxisd to_viewer(azimuth, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d key = middle + size * (to_viewer * Eigen::Vector3d(-2.1, 2.3, 2.2));
  const Eigen::Vector3d rim = middle + size * (to_viewer * Eigen::Vector3d(2.4, 1.6, -2.4));
  scene.area_lights.push_back(softbox(key, middle, 0.8 * size, 0.8 * size, {10.0f, 9.6f, 9.1f}));
  scene.area_lights.push_back(softbox(rim, middle, 0.5 * size, 1.1 * size, {3.2f, 3.4f, 3.7f}));
  return scene;
}

Look clay_look() {
  Look look;
  look.color = {0.64f, 0.61f, 0.58f};
  look.roughness = 0.55f;
  look.specular = 0.35f;
  look.back_color = Eigen::Vector3f(0.50f, 0.22f, 0.15f);
  return look;
}

Image picture_of(const std::vector<RenderMesh>& meshes, const View& view,
                 const PictureOptions& options) {
  const Points points = all_vertices(meshes);
  check_subject(meshes, points);
  Camera camera;
  if (points.rows() > 0) {
    camera = camera_around(points, view, options.width, options.height, options.framing);
  } else {
    Points corners(2, 3);
    corners << -0.5, 0, -0.5, 0.5, 1.8, 0.5;
    camera = camera_around(corners, view, options.width, options.height, options.framing);
  }
  RenderOptions render_options;
  render_options.samples = options.samples;
  render_options.ambient_samples = 4;
  return tone_mapped(render(studio_scene(meshes, view.azimuth), camera, render_options),
                     {.dither = 1});
}

std::vector<Image> turntable_of(const std::vector<RenderMesh>& meshes, int count, const View& start,
                                const PictureOptions& options, const std::function<bool()>& stop) {
  const Points points = all_vertices(meshes);
  check_subject(meshes, points);
  const std::vector<Camera> cameras =
      turntable_cameras(points, start, count, options.width, options.height, options.framing);
  RenderOptions render_options;
  render_options.samples = options.samples;
  render_options.ambient_samples = 4;
  std::vector<Image> pictures;
  for (int i = 0; i < count && !(stop && stop()); ++i) {
    const double azimuth = start.azimuth + 2 * std::numbers::pi * i / count;
    pictures.push_back(tone_mapped(
        render(studio_scene(meshes, azimuth), cameras[static_cast<std::size_t>(i)], render_options),
        {.dither = 1}));
  }
  return pictures;
}

Image picture_of(const Mesh& mesh, const View& view, const PictureOptions& options) {
  Look look = clay_look();
  if (mesh.colors.rows() > 0) {
    look.color = {1, 1, 1};
  }
  return picture_of(std::vector<RenderMesh>{{mesh, look}}, view, options);
}

}  // namespace atelier

#include "capture/synthetic_studio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace atelier {
namespace {

using Color = Eigen::Vector3f;

constexpr double kBehind = 0.16;      // m from a camera's centre out to its post
constexpr double kPostWidth = 0.045;  // m
constexpr double kSamePost = 0.25;    // m, cameras whose posts stand nearer share one

AreaLight softbox(const Eigen::Vector3d& from, const Eigen::Vector3d& at, double half_width,
                  double half_height, float radiance) {
  const Eigen::Vector3d forward = (at - from).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  AreaLight light;
  light.center = from;
  light.half_u = half_width * right;
  light.half_v = -half_height * right.cross(forward);
  light.radiance = Color(radiance, 0.97F * radiance, 0.92F * radiance);
  return light;
}

/// Appends a box: its centre, and half its sides as columns.
void add_box(std::vector<Eigen::Vector3d>& vertices, std::vector<Eigen::Vector3i>& faces,
             const Eigen::Vector3d& center, const Eigen::Matrix3d& half) {
  // Each side has corners of its own, so that normals do not run round the edges.
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto first = static_cast<int>(vertices.size());
      const Eigen::Vector3d n = side * half.col(axis);
      const Eigen::Vector3d u = half.col((axis + 1) % 3);
      const Eigen::Vector3d v = side * half.col((axis + 2) % 3);
      for (const auto& [a, b] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        vertices.emplace_back(center + n + a * u + b * v);
      }
      faces.emplace_back(first, first + 1, first + 2);
      faces.emplace_back(first, first + 2, first + 3);
    }
  }
}

/// Posts with a foot and their height.
struct Post {
  Eigen::Vector2d place;  ///< x, z
  double top = 0;
};

std::vector<Post> posts_of(const std::vector<Camera>& cameras) {
  std::vector<Post> posts;
  for (const Camera& camera : cameras) {
    const Eigen::Vector3d center = camera_center(camera);
    const Eigen::Vector2d ground(center.x(), center.z());
    const Eigen::Vector2d place = ground + kBehind * ground.normalized();
    const auto same = std::find_if(posts.begin(), posts.end(), [&](const Post& post) {
      return (post.place - place).norm() < kSamePost;
    });
    if (same == posts.end()) {
      posts.push_back({place, center.y() + 0.15});
    } else {
      same->top = std::max(same->top, center.y() + 0.15);
    }
  }
  return posts;
}

/// Everything lies behind the plane of each camera's own picture.
RenderMesh rig_of(const std::vector<Camera>& cameras) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> faces;
  std::vector<Post> posts = posts_of(cameras);
  double top = 0;
  double radius = 0;
  for (const Post& post : posts) {
    top = std::max(top, post.top);
    radius = std::max(radius, post.place.norm());
  }
  const auto upright = [](const Eigen::Vector2d& outward, double depth, double width,
                          double height) {
    Eigen::Matrix3d half;
    half.col(0) = width * Eigen::Vector3d(outward.y(), 0, -outward.x());
    half.col(1) = height * Eigen::Vector3d::UnitY();
    half.col(2) = depth * Eigen::Vector3d(outward.x(), 0, outward.y());
    return half;
  };
  for (const Post& post : posts) {
    const Eigen::Vector2d outward = post.place.normalized();
    add_box(vertices, faces, {post.place.x(), top / 2, post.place.y()},
            upright(outward, kPostWidth / 2, kPostWidth / 2, top / 2));
    add_box(vertices, faces, {post.place.x(), 0.012, post.place.y()},
            upright(outward, 0.13, 0.17, 0.012));
  }
  // A ring on top holds the posts together.
  constexpr int kSegments = 60;
  for (int i = 0; i < kSegments; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSegments;
    const Eigen::Vector2d outward(std::sin(angle), std::cos(angle));
    const double width = radius * std::tan(std::numbers::pi / kSegments);
    add_box(vertices, faces, {radius * outward.x(), top, radius * outward.y()},
            upright(outward, kPostWidth / 2, width, kPostWidth / 2));
  }
  // Housings and lenses: boxes behind each camera's centre.
  for (const Camera& camera : cameras) {
    const Eigen::Vector3d center = camera_center(camera);
    const Eigen::Matrix3d axes = camera.camera_from_world_rotation.transpose();
    const auto along = [&](double from, double to, double half_side) {
      add_box(vertices, faces, center + 0.5 * (from + to) * axes.col(2),
              axes * Eigen::Vector3d(half_side, half_side, std::abs(from - to) / 2).asDiagonal());
    };
    along(-0.008, -0.05, 0.026);
    along(-0.05, -0.14, 0.042);
  }
  RenderMesh rig;
  rig.mesh.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    rig.mesh.vertices.row(static_cast<Index>(v)) = vertices[v].transpose();
  }
  rig.mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    rig.mesh.faces.row(static_cast<Index>(f)) = faces[f].transpose();
  }
  rig.look.color = Color(0.055F, 0.056F, 0.06F);
  rig.look.roughness = 0.5F;
  return rig;
}

}  // namespace

Scene studio_surroundings(const std::vector<Camera>& cameras) {
  Scene scene;
  const Eigen::Vector3d subject(0, 1.0, 0);
  scene.area_lights.push_back(softbox({2.4, 3.5, 2.8}, subject, 1.2, 0.9, 7.5F));
  scene.area_lights.push_back(softbox({-2.6, 3.4, -2.4}, subject, 1.2, 0.9, 5.5F));
  scene.environment.zenith = Color(0.62F, 0.64F, 0.67F);
  scene.environment.horizon = Color(0.46F, 0.465F, 0.48F);
  scene.environment.nadir = Color(0.30F, 0.30F, 0.305F);
  scene.background.kind = Background::Kind::Environment;
  scene.ground = Ground{0, Color(0.34F, 0.335F, 0.33F), true};
  scene.meshes.push_back(rig_of(cameras));
  return scene;
}

}  // namespace atelier

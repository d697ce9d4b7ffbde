#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "core/camera.h"
#include "core/image.h"
#include "core/io/image_file.h"
#include "core/mesh.h"
#include "core/render/scene.h"

namespace atelier::fixtures {

/// A unit sphere of latitudes and longitudes with uvs, poles on the y axis.
inline Mesh sphere(int rows = 48, int columns = 96, double radius = 1,
                   const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  Mesh mesh;
  mesh.vertices.resize((rows + 1) * columns, 3);
  mesh.uvs.resize((rows + 1) * (columns + 1), 2);
  for (int r = 0; r <= rows; ++r) {
    const double polar = std::numbers::pi * r / rows;
    for (int c = 0; c < columns; ++c) {
      const double azimuth = 2 * std::numbers::pi * c / columns;
      mesh.vertices.row(r * columns + c) =
          center.transpose() + radius * Eigen::RowVector3d(std::sin(polar) * std::sin(azimuth),
                                                           std::cos(polar),
                                                           std::sin(polar) * std::cos(azimuth));
    }
    for (int c = 0; c <= columns; ++c) {
      mesh.uvs.row(r * (columns + 1) + c) << double(c) / columns, 1 - double(r) / rows;
    }
  }
  mesh.faces.resize(2 * columns * (rows - 1), 3);
  mesh.uv_faces.resize(mesh.faces.rows(), 3);
  Index f = 0;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const int d = (c + 1) % columns;
      const int a = r * columns + c, b = (r + 1) * columns + c;
      const int e = (r + 1) * columns + d, g = r * columns + d;
      const int ta = r * (columns + 1) + c, tb = ta + columns + 1;
      if (r + 1 < rows) {
        mesh.faces.row(f) << a, b, e;
        mesh.uv_faces.row(f++) << ta, tb, tb + 1;
      }
      if (r > 0) {
        mesh.faces.row(f) << a, e, g;
        mesh.uv_faces.row(f++) << ta, tb + 1, ta + 1;
      }
    }
  }
  return mesh;
}

/// A rectangle about `center` spanned by two half sides; its front is `u x v`, uv (0,0) at -u-v.
inline Mesh rectangle(const Eigen::Vector3d& center, const Eigen::Vector3d& u,
                      const Eigen::Vector3d& v) {
  Mesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << (center - u - v).transpose(), (center + u - v).transpose(),
      (center + u + v).transpose(), (center - u + v).transpose();
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3;
  mesh.uvs.resize(4, 2);
  mesh.uvs << 0, 0, 1, 0, 1, 1, 0, 1;
  mesh.uv_faces = mesh.faces;
  return mesh;
}

/// A camera at `eye` that looks at `target`; `focal` in pixels.
inline Camera look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, int width,
                      int height, double focal) {
  Camera camera;
  camera.id = "test";
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = focal;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d helper =
      std::abs(forward.y()) > 0.99 ? Eigen::Vector3d(0, 0, -1) : Eigen::Vector3d(0, 1, 0);
  const Eigen::Vector3d right = forward.cross(helper).normalized();
  camera.camera_from_world_rotation.row(0) = right;
  camera.camera_from_world_rotation.row(1) = forward.cross(right);
  camera.camera_from_world_rotation.row(2) = forward;
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * eye;
  return camera;
}

/// A diffuse surface without gloss.
inline Look matt(const Eigen::Vector3f& color) {
  Look look;
  look.color = color;
  look.specular = 0;
  return look;
}

/// A flat floor of `cells` x `cells` squares over [-half, half]^2 at y = 0, facing up.
inline Mesh floor_grid(double half, int cells) {
  Mesh mesh;
  const int n = cells + 1;
  mesh.vertices.resize(n * n, 3);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      mesh.vertices.row(j * n + i) << half * (2.0 * i / cells - 1), 0, half * (2.0 * j / cells - 1);
    }
  }
  mesh.faces.resize(2 * cells * cells, 3);
  Index f = 0;
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * n + i, b = a + 1, c = a + n, d = c + 1;
      mesh.faces.row(f++) << a, c, d;
      mesh.faces.row(f++) << a, d, b;
    }
  }
  return mesh;
}

/// One pixel's colour.
inline Eigen::Vector3f color_at(const Image& image, int x, int y) {
  return {image.at(x, y, 0), image.at(x, y, 1), image.at(x, y, 2)};
}

/// For looking at what a test renders: written only where ATELIER_TEST_PICTURES names a folder.
inline void keep_picture(const std::string& name, const Image& image) {
  const char* folder = std::getenv("ATELIER_TEST_PICTURES");
  if (folder == nullptr) {
    return;
  }
  write_image(std::string(folder) + "/" + name + ".png", image);
}

}  // namespace atelier::fixtures

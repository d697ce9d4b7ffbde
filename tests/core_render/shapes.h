#pragma once

#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/image.h"
#include "core/mesh.h"

namespace atelier::testing {

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

/// For looking at what a test renders: written only where ATELIER_TEST_PICTURES names a folder.
inline void keep_picture(const std::string& name, const Image& image) {
  const char* folder = std::getenv("ATELIER_TEST_PICTURES");
  if (folder == nullptr) {
    return;
  }
  ByteImage bytes = srgb_from_linear(image);
  cv::Mat rgb(bytes.height, bytes.width, bytes.channels == 4 ? CV_8UC4 : CV_8UC3,
              bytes.data.data());
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, bytes.channels == 4 ? cv::COLOR_RGBA2BGRA : cv::COLOR_RGB2BGR);
  cv::imwrite(std::string(folder) + "/" + name + ".png", bgr);
}

}  // namespace atelier::testing

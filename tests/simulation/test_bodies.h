#pragma once

#include <cmath>
#include <vector>

#include "core/mesh.h"

namespace atelier::fixtures {

/// A plane through the origin that falls by `angle` along +x, `size` each way, as a body.
inline Mesh incline(double angle, double size) {
  Mesh plane;
  plane.vertices.resize(4, 3);
  const double c = std::cos(angle) * size;
  const double s = std::sin(angle) * size;
  plane.vertices << -c, s, -size, c, -s, -size, c, -s, size, -c, s, size;
  plane.faces.resize(2, 3);
  plane.faces << 0, 2, 1, 0, 3, 2;
  return plane;
}

/// A cube of side 1 whose top lies at `top`, two triangles a side.
inline Mesh cube(double top) {
  Mesh mesh;
  mesh.vertices.resize(8, 3);
  for (int v = 0; v < 8; ++v) {
    mesh.vertices.row(v) << (v & 4 ? 0.5 : -0.5), (v & 2 ? top : top - 1), (v & 1 ? 0.5 : -0.5);
  }
  mesh.faces.resize(12, 3);
  mesh.faces << 0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0,
      6, 4, 1, 5, 7, 1, 7, 3;
  return mesh;
}

inline Mesh sphere(double radius, int rings, int sectors) {
  Mesh mesh;
  mesh.vertices.resize(2 + (rings - 1) * sectors, 3);
  mesh.vertices.row(0) << 0, radius, 0;
  mesh.vertices.row(1) << 0, -radius, 0;
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      const double polar = 3.14159265358979323846 * r / rings;
      const double turn = 2 * 3.14159265358979323846 * s / sectors;
      mesh.vertices.row(2 + (r - 1) * sectors + s) << radius * std::sin(polar) * std::cos(turn),
          radius * std::cos(polar), radius * std::sin(polar) * std::sin(turn);
    }
  }
  std::vector<Eigen::RowVector3i> faces;
  const auto id = [&](int r, int s) {
    return r == 0 ? 0 : r == rings ? 1 : 2 + (r - 1) * sectors + s % sectors;
  };
  for (int r = 0; r < rings; ++r) {
    for (int s = 0; s < sectors; ++s) {
      if (r > 0) {
        faces.emplace_back(id(r, s), id(r, s + 1), id(r + 1, s + 1));
      }
      if (r < rings - 1) {
        faces.emplace_back(id(r, s), id(r + 1, s + 1), id(r + 1, s));
      }
    }
  }
  mesh.faces.resize(Index(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.row(Index(i)) = faces[i];
  }
  return mesh;
}

}  // namespace atelier::fixtures

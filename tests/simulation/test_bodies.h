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

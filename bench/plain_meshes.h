#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "core/mesh.h"

namespace atelier {

/// `side` x `side` vertices in the plane y = 0 about the origin, diagonals in turn.
inline Mesh square_sheet(int side, double size) {
  Mesh mesh;
  mesh.vertices.resize(side * side, 3);
  mesh.faces.resize(2 * (side - 1) * (side - 1), 3);
  Index f = 0;
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      const int a = r * side + c;
      mesh.vertices.row(a) << size * (c / (side - 1.0) - 0.5), 0, size * (r / (side - 1.0) - 0.5);
      if (r + 1 < side && c + 1 < side) {
        if ((r + c) % 2 == 0) {
          mesh.faces.row(f++) << a, a + side, a + side + 1;
          mesh.faces.row(f++) << a, a + side + 1, a + 1;
        } else {
          mesh.faces.row(f++) << a, a + side, a + 1;
          mesh.faces.row(f++) << a + 1, a + side, a + side + 1;
        }
      }
    }
  }
  return mesh;
}

/// A ball about the origin of 2 `rings` x `rings` quads, poles on the y axis.
inline Mesh ball_mesh(double radius, int rings) {
  const int around = 2 * rings;
  Mesh mesh;
  mesh.vertices.resize((rings - 1) * around + 2, 3);
  std::vector<Eigen::RowVector3i> faces;
  const int top = (rings - 1) * around;
  mesh.vertices.row(top) << 0, radius, 0;
  mesh.vertices.row(top + 1) << 0, -radius, 0;
  for (int r = 1; r < rings; ++r) {
    const double polar = std::numbers::pi * r / rings;
    for (int i = 0; i < around; ++i) {
      const double turn = 2 * std::numbers::pi * i / around;
      const int a = (r - 1) * around + i;
      const int b = (r - 1) * around + (i + 1) % around;
      mesh.vertices.row(a) << radius * std::sin(polar) * std::cos(turn), radius * std::cos(polar),
          radius * std::sin(polar) * std::sin(turn);
      if (r == 1) {
        faces.emplace_back(top, b, a);
      }
      if (r + 1 < rings) {
        faces.emplace_back(a, b, b + around);
        faces.emplace_back(a, b + around, a + around);
      } else {
        faces.emplace_back(top + 1, a, b);
      }
    }
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) = faces[i];
  }
  return mesh;
}

}  // namespace atelier

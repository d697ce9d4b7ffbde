#pragma once

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "core/mesh.h"

namespace atelier::fixtures {

/// A mesh from lists.
inline Mesh mesh_of(const std::vector<std::array<double, 3>>& vertices,
                    const std::vector<std::array<int, 3>>& faces) {
  Mesh mesh;
  mesh.vertices.resize(static_cast<Index>(vertices.size()), 3);
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    mesh.vertices.row(static_cast<Index>(i)) << vertices[i][0], vertices[i][1], vertices[i][2];
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.row(static_cast<Index>(i)) << faces[i][0], faces[i][1], faces[i][2];
  }
  return mesh;
}

/// Corners of the regular tetrahedron inscribed in the cube [-1,1]^3.
inline Mesh tetrahedron() {
  return mesh_of({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
                 {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}});
}

/// The unit sphere: a subdivided octahedron, 8 * 4^levels faces.
inline Mesh sphere(int levels) {
  std::vector<std::array<double, 3>> vertices = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                                 {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  std::vector<std::array<int, 3>> faces = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                           {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
      if (is_new) {
        const Eigen::Vector3d sum(vertices[a][0] + vertices[b][0], vertices[a][1] + vertices[b][1],
                                  vertices[a][2] + vertices[b][2]);
        const Eigen::Vector3d unit = sum.normalized();
        vertices.push_back({unit.x(), unit.y(), unit.z()});
      }
      return place->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const int ab = middle(a, b);
      const int bc = middle(b, c);
      const int ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  return mesh_of(vertices, faces);
}

/// A grid of nx by nz cells over [0,1]^2 in the plane y = 0, facing +Y.
inline Mesh grid(int nx, int nz) {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<int, 3>> faces;
  for (int z = 0; z <= nz; ++z) {
    for (int x = 0; x <= nx; ++x) {
      vertices.push_back({static_cast<double>(x) / nx, 0, static_cast<double>(z) / nz});
    }
  }
  for (int z = 0; z < nz; ++z) {
    for (int x = 0; x < nx; ++x) {
      const int a = z * (nx + 1) + x;
      const int b = a + 1;
      const int c = a + nx + 1;
      const int d = c + 1;
      faces.push_back({a, c, b});
      faces.push_back({b, c, d});
    }
  }
  return mesh_of(vertices, faces);
}

/// A torus around the Y axis, closed; `n` by `m` quads; tube radius `r` on radius 1.
inline Mesh torus(int n, int m, double r = 0.4) {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<int, 3>> faces;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const double u = 2 * std::numbers::pi * i / n;
      const double v = 2 * std::numbers::pi * j / m;
      const double radius = 1 + r * std::cos(v);
      vertices.push_back({radius * std::cos(u), r * std::sin(v), -radius * std::sin(u)});
      const int a = i * m + j;
      const int b = (i + 1) % n * m + j;
      const int c = i * m + (j + 1) % m;
      const int d = (i + 1) % n * m + (j + 1) % m;
      faces.push_back({a, b, c});
      faces.push_back({c, b, d});
    }
  }
  return mesh_of(vertices, faces);
}

/// An open tube around the Y axis: radius 1, y in [0, height], facing outwards.
inline Mesh tube(int around, int along, double height = 2) {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<int, 3>> faces;
  for (int j = 0; j <= along; ++j) {
    for (int i = 0; i < around; ++i) {
      const double u = 2 * std::numbers::pi * i / around;
      vertices.push_back({std::cos(u), height * j / along, -std::sin(u)});
      if (j < along) {
        const int a = j * around + i;
        const int b = j * around + (i + 1) % around;
        faces.push_back({a, b, a + around});
        faces.push_back({a + around, b, b + around});
      }
    }
  }
  return mesh_of(vertices, faces);
}

}  // namespace atelier::fixtures

#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <vector>

#include "core/mesh.h"

namespace atelier::fixtures {

/// A shirt of two flat sheets 10 cm apart that meet at its sides: trunk 32 cm wide and 48 cm high,
/// arms 12 cm high from there to 40 cm off the middle, openings below, at both ends and of 12 cm at
/// the neck. Faces +z, outside outwards, squares of 2 cm in two triangles. Armpits at x = +-0.16,
/// y = 0.36; the shoulders' top at y = 0.48.
inline Mesh pillow_tee() {
  constexpr double kStep = 0.02;
  constexpr double kDeep = 0.05;
  constexpr int kHalf = 8, kArm = 20, kUnder = 18, kTop = 24, kNeck = 3;
  const auto is_cell = [&](int x, int y) {
    const bool trunk = x >= -kHalf && x < kHalf && y >= 0 && y < kTop;
    const bool arms = x >= -kArm && x < kArm && y >= kUnder && y < kTop;
    return trunk || arms;
  };
  const auto on_outline = [&](int x, int y) {
    return !(is_cell(x, y) && is_cell(x - 1, y) && is_cell(x, y - 1) && is_cell(x - 1, y - 1));
  };
  const auto is_open = [&](int x, int y) {
    return (y == 0 && std::abs(x) < kHalf) || (std::abs(x) == kArm && y > kUnder && y < kTop) ||
           (y == kTop && std::abs(x) < kNeck);
  };
  std::map<std::array<int, 3>, int> at;
  std::vector<Eigen::RowVector3d> vertices;
  const auto vertex = [&](int x, int y, int side) {
    const bool sewn = on_outline(x, y) && !is_open(x, y);
    const auto [place, fresh] =
        at.try_emplace({x, y, sewn ? 0 : side}, static_cast<int>(vertices.size()));
    if (fresh) {
      vertices.emplace_back(kStep * x, kStep * y, sewn ? 0 : kDeep * side);
    }
    return place->second;
  };
  std::vector<std::array<int, 3>> faces;
  for (const int side : {1, -1}) {
    for (int x = -kArm; x < kArm; ++x) {
      for (int y = 0; y < kTop; ++y) {
        if (!is_cell(x, y)) {
          continue;
        }
        const std::array<int, 4> square{vertex(x, y, side), vertex(x + 1, y, side),
                                        vertex(x + 1, y + 1, side), vertex(x, y + 1, side)};
        for (std::array<int, 3> face : {std::array{square[0], square[1], square[2]},
                                        std::array{square[0], square[2], square[3]}}) {
          if (side < 0) {
            std::swap(face[1], face[2]);
          }
          faces.push_back(face);
        }
      }
    }
  }
  Mesh mesh;
  mesh.vertices.resize(static_cast<Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    mesh.vertices.row(static_cast<Index>(v)) = vertices[v];
  }
  mesh.faces.resize(static_cast<Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    mesh.faces.row(static_cast<Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  }
  return mesh;
}

}  // namespace atelier::fixtures

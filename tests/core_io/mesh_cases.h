#pragma once

#include <cmath>
#include <string>

#include "core/error.h"
#include "core/io/polygon_mesh.h"
#include "tests/support/shapes.h"

namespace atelier::fixtures {

/// What DataError says when `read` is called; "was read" if it throws none.
template <class Read>
std::string refusal_of(const Read& read) {
  try {
    read();
  } catch (const DataError& error) {
    return error.what();
  }
  return "was read";
}

/// A sphere with every attribute that a mesh may have; its positions are no short decimals.
inline Mesh full_mesh() {
  Mesh mesh = sphere(2);
  const Index n = mesh.vertices.rows();
  mesh.normals = mesh.vertices;
  mesh.vertices *= 1.0 / 3.0;
  make_unit_rows(mesh.normals);
  mesh.colors.resize(n, 3);
  mesh.confidence.resize(n);
  mesh.labels.resize(static_cast<std::size_t>(n));
  mesh.uvs.resize(n, 2);
  for (Index i = 0; i < n; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(n);
    mesh.colors.row(i) << t, 1 - t, t * t;
    mesh.confidence[i] = t;
    mesh.labels[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i);
    mesh.uvs.row(i) << 1.0 / (1.0 + i), std::sqrt(i);
  }
  mesh.uv_faces = mesh.faces;
  return mesh;
}

}  // namespace atelier::fixtures

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/types.h"

namespace atelier {

/// A triangle mesh in metres, right-handed, Y up. A scan is a Mesh with colours, labels and
/// confidence. Every attribute is either empty or has the rows stated.
struct Mesh {
  Points vertices;  ///< [V,3] metres
  Triangles faces;  ///< [F,3] into vertices, counter-clockwise from outside

  Points normals;                    ///< [V,3] unit length, or empty
  Colors colors;                     ///< [V,3] linear RGB in [0,1], or empty
  Points2 uvs;                       ///< [T,2] texture coordinates, v up, or empty
  Triangles uv_faces;                ///< [F,3] into uvs, or empty
  std::vector<std::uint8_t> labels;  ///< [V] ids of the label taxonomy, or empty
  Eigen::VectorXf confidence;        ///< [V] in [0,1], or empty
};

/// Throws DataError (with `file` as its file) unless every attribute has the stated rows, every
/// index is in range and every number is finite. Cost: one pass.
void check_mesh(const Mesh& mesh, const std::string& file = "");

}  // namespace atelier

#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "bodymodel/formats/makehuman.h"
#include "core/limits.h"

namespace atelier {

/// How one vertex of a garment hangs on the base mesh.
struct MhcloVertex {
  int base[3] = {0, 0, 0};  ///< base vertices
  Eigen::Vector3d weights{1, 0, 0};
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< file's unit, times the scale of each axis
};

/// A .mhclo file: a garment that follows any MakeHuman body.
struct Mhclo {
  std::string name;
  std::string obj_file;  ///< as the file writes it: a name, not to be followed outside its folder
  std::vector<MhcloVertex> vertices;
  int scale_vertices[3][2] = {{-1, -1}, {-1, -1}, {-1, -1}};  ///< of x, y, z; -1: no scale
  Eigen::Vector3d scale_lengths{1, 1, 1};                     ///< their distance when it was made
  std::vector<int> deleted;  ///< base vertices that the garment hides, increasing
};

/// Reads a .mhclo for the base mesh hm08. Words that do not concern geometry are skipped, wherever
/// they stand. Throws DataError, with the line, for another base mesh, vertices out of
/// [0, base_vertices), rows with other than 1 or 9 words, numbers that are not finite, scales of no
/// length, no vertices.
Mhclo read_mhclo(std::span<const std::byte> bytes, const std::string& name, Index base_vertices,
                 const Limits& limits = {});
Mhclo read_mhclo(const std::filesystem::path& path, Index base_vertices, const Limits& limits = {});

/// Where the garment's vertices are on a body, metres: position = sum w_i V_i + offset |V_a - V_b|
/// / length, axis by axis. `base` is MakeHumanBody::base, or its vertices in any pose or shape.
Points fitted_vertices(const Mhclo& garment, const Points& base);

/// Weights of the garment's vertices, blended from those of the body that they hang on.
SkinWeights fitted_weights(const Mhclo& garment, const SkinWeights& base_skin, Index joints);

/// A garment worn by a body, as a body model with the same skeleton: the mesh of the .mhclo's OBJ
/// (which must stand beside it) on the body's shape. Throws DataError if OBJ and .mhclo disagree.
BodyModel read_makehuman_garment(const std::filesystem::path& mhclo, const MakeHumanBody& body,
                                 const Limits& limits = {});

}  // namespace atelier

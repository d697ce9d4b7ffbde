#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bodymodel/formats/skin_weights.h"
#include "core/limits.h"

namespace atelier {

/// A bone of a MakeHuman or MPFB2 rig: its ends are means of base-mesh vertices, so that they
/// follow any body shape.
struct RigBone {
  std::string name;
  int parent = -1;                 ///< index into the rig
  std::vector<int> head_vertices;  ///< the joint is their mean
  std::vector<int> tail_vertices;
};

/// Bones, parents before children, one root.
using Rig = std::vector<RigBone>;

/// Named vertices of the base mesh, as its OBJ groups give them ("joint-pelvis").
using VertexGroups = std::vector<VertexGroup>;

/// Reads a rig: MakeHuman's .mhskel ("bones" and "joints") or MPFB2's rig JSON (heads and tails by
/// strategy CUBE, VERTEX, MEAN or XYZ, of which the last is refused, as it follows no shape).
/// Throws DataError for a missing field, an unknown parent, cycle, no or two roots, an unknown
/// cube, joint or strategy, a vertex out of range, or more than `limits.joints` bones.
Rig parse_rig(const nlohmann::json& json, const VertexGroups& groups, Index base_vertices,
              const std::string& file = "", const Limits& limits = {});
Rig read_rig(const std::filesystem::path& path, const VertexGroups& groups, Index base_vertices,
             const Limits& limits = {});

/// Reads a .mhw or weights JSON: {"weights": {bone: [[vertex, weight], ...]}}, one list of
/// influences for each base vertex. Throws DataError for a bone that the rig does not have, a
/// vertex out of range, or weights that are no finite numbers.
std::vector<std::vector<Influence>> parse_rig_weights(const nlohmann::json& json, const Rig& rig,
                                                      Index base_vertices,
                                                      const std::string& file = "");
std::vector<std::vector<Influence>> read_rig_weights(const std::filesystem::path& path,
                                                     const Rig& rig, Index base_vertices,
                                                     const Limits& limits = {});

}  // namespace atelier

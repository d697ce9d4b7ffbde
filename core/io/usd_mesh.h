#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/io/usd_stage.h"
#include "core/limits.h"
#include "core/mesh.h"

namespace atelier {

/// All meshes of a USD layer as one, in metres and Y up.
struct UsdMesh {
  Mesh mesh;                   ///< by default; where there is none, at the first time
  double fps = 24;             ///< time codes a second
  std::vector<double> times;   ///< [F] time codes at which something moves, or empty
  std::vector<Points> frames;  ///< [F] of [V,3]: vertices at these times
  std::vector<Finding> findings;
};

/// Every defined Mesh that is to be seen and rendered (visibility, purpose), placed by its
/// transforms and those above it, each sampled attribute linear between its times (UsdGeom);
/// polygons triangulated, texture coordinates (primvars:st, or else the first of that type) where
/// all meshes have them. Throws DataError
/// (`file`, prim) if there is no mesh, for arrays that do not fit one another, faces that change
/// over time, and what `limits` do not allow. Findings: what other layers would add; skeletons,
/// whose poses are not applied; what point instancers repeat, which is left out.
UsdMesh usd_mesh(const UsdStage& stage, const std::string& file, const Limits& limits = {});

/// Whether a file name is one of USD: .usd, .usda, .usdc, .usdz.
bool has_usd_extension(const std::filesystem::path& path);

/// Reads USD, binary or text (.usdc, .usda, .usd), or the first layer of a package (.usdz).
UsdMesh read_usd_mesh(const std::filesystem::path& path, const Limits& limits = {});

}  // namespace atelier

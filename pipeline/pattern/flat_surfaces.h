#pragma once

#include <filesystem>

namespace atelier {

/// The surfaces that a run flattens, in the folder `surfaces` of the workspace: each garment
/// without the area that folds take of it (rest.obj of a registered one,
/// registration/flattening/rest_surface.h); the template's meshes where nothing is registered.
/// Recomputed when these results have changed (core/store/derived_folder.h). Throws DataError where
/// a result is missing or damaged, EnvironmentError.
std::filesystem::path flat_surfaces(const std::filesystem::path& workspace);

}  // namespace atelier

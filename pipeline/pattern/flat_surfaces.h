#pragma once

#include <filesystem>

namespace atelier {

/// The surfaces that a run flattens, in the folder `surfaces` of the workspace: each garment
/// without the area that folds take of it (rest.obj of a registered one,
/// registration/flattening/rest_surface.h); the template's meshes where nothing is registered.
/// Beside them `captured/LABEL` (sew_check.h): the garment and its body in a frame in which it hung
/// still: the template's, or, where its motion held it up there, the registered one in which it did
/// least. Recomputed when these results have changed (core/store/derived_folder.h). Throws
/// DataError where a result is missing or damaged, EnvironmentError.
std::filesystem::path flat_surfaces(const std::filesystem::path& workspace);

}  // namespace atelier

#pragma once

#include <filesystem>
#include <vector>

namespace atelier {

/// The folder of a scene that says where its garments were captured.
inline constexpr const char* kCapturedFolder = "captured";

/// The scene that a run simulates (scene_in, simulation_scene.h), in the folder `scene` of the
/// workspace: the registered garments in the pose of their first frame, all in one mesh, what holds
/// them (holding.toml), where they were registered, and the body under them in every such frame.
/// Recomputed when these results have changed (core/store/derived_folder.h). Throws DataError where
/// a result is missing or damaged, EnvironmentError.
std::filesystem::path captured_scene(const std::filesystem::path& workspace);

/// The sequences of the registered garments in a result, by name. Throws DataError where there is
/// none.
std::vector<std::filesystem::path> registered_folders(const std::filesystem::path& registered);

}  // namespace atelier

#pragma once

#ifdef ATELIER_HAS_CAPTURE

#include <filesystem>

namespace atelier {

/// What `simulate` reads (scene_in, simulation_scene.h), made of results of a workspace and kept in
/// its folder `scene`: made anew only when these results have changed, and then whole. Throws
/// DataError where a result is missing or damaged, as `dress_body` does, and EnvironmentError.

/// The registered garments in the pose of their first frame, all in one mesh, and the body under
/// them in every registered frame.
std::filesystem::path captured_scene(const std::filesystem::path& workspace);

/// Where no garment was captured: a tee and a skirt, drafted to the measures of the person's body
/// and sewn on it, and the person's tracked motion (the longest sequence).
std::filesystem::path drafted_scene(const std::filesystem::path& workspace);

}  // namespace atelier

#endif

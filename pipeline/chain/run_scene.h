#pragma once

#include <filesystem>

namespace atelier {

/// What a run makes of a workspace's results, in folders of the workspace: recomputed only
/// when these results have changed, and then whole, with their consent. Throws DataError where a
/// result is missing or damaged, and EnvironmentError.

/// What `flatten` reads, in the folder `surfaces`: each garment without what folds take of it
/// (rest.obj of `register`, registration/flattening/rest_surface.h); the template's meshes where
/// nothing is registered.
std::filesystem::path flat_surfaces(const std::filesystem::path& workspace);

/// What `simulate` reads (scene_in, simulation_scene.h), in the folder `scene`.

/// The registered garments in the pose of their first frame, all in one mesh, and the body under
/// them in every registered frame.
std::filesystem::path captured_scene(const std::filesystem::path& workspace);

/// For other programs, in the folder `export`: the avatar as glTF, its motion as BVH, and the
/// patterns that were found (export_motion.h). `atelier export` writes everything.
std::filesystem::path exported_avatar(const std::filesystem::path& workspace);

}  // namespace atelier

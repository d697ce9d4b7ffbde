#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "capture/stereo/stereo.h"
#include "core/image.h"
#include "core/limits.h"
#include "core/types.h"

namespace atelier {

/// Depth maps of an instant as COLMAP's dense workspaces hold them (doc/format.rst), so that its
/// `stereo_fusion` and meshers, and readers of its maps, take them: `images/<camera>.png` without
/// distortion, sparse/ of pinhole cameras as text, `stereo/depth_maps/<camera>.png.geometric.bin`
/// (metres, 0: none), stereo/normal_maps/ (in the camera's frame), stereo/fusion.cfg. Ours beside
/// it: stereo/confidence_maps/.
///
/// Writes what does not depend on maps: cameras and images (linear RGB) of all views, and places
/// [N,3] near the surface as sparse points, seen by every view that has them in its image: by
/// them COLMAP tells which views overlap. Throws EnvironmentError for disks.
void write_dense_workspace(const std::filesystem::path& folder, const std::vector<Camera>& cameras,
                           const std::vector<Image>& images, const Points& places);

/// Adds one view's maps.
void write_depth_map(const std::filesystem::path& folder, const DepthMap& map);

/// True if the view has all its maps.
bool has_depth_map(const std::filesystem::path& folder, const Camera& camera);

/// The maps of a camera without distortion. Throws DataError where one is missing, not of the
/// camera's size, or holds what no depth, normal or confidence can be.
DepthMap read_depth_map(const std::filesystem::path& folder, const Camera& camera,
                        const Limits& limits = {});

/// "width&height&channels&", then floats, channel by channel: COLMAP's matrices.
std::string colmap_matrix(const Image& image);
Image parse_colmap_matrix(std::span<const std::byte> bytes, const std::string& file = "",
                          const Limits& limits = {});

}  // namespace atelier

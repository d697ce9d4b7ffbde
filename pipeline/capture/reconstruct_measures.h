#pragma once

#include <filesystem>
#include <vector>

#include "core/measure.h"

namespace atelier {

/// keypoints.* and surface.*, labels.* of a workspace's result against a synthetic capture's ground
/// truth; none where there is no result.
std::vector<Measure> measure_reconstruct(const std::filesystem::path& workspace,
                                         const std::filesystem::path& truth);

/// "surface.chamfer_mm", "surface.completeness" and "surface.floating" of any mesh in the capture's
/// frame of reference (metres, Y up) against what the ground truth shows at a frame. Throws as
/// read_mesh and read_ground_truth_frame.
std::vector<Measure> measure_surface(const std::filesystem::path& mesh, int frame,
                                     const std::filesystem::path& capture);

}  // namespace atelier

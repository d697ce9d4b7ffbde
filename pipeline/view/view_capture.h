#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "capture/dataset.h"
#include "pipeline/view/view_page.h"

namespace atelier {

/// Puts a capture's images, keypoints, masks and labels on the page, a file for each camera and
/// frame, a small image for its frustum, and one file of how well the cameras agree. Images of
/// held-out cameras are not opened. Returns what the page is told of the cameras.
/// @param keypoints3d  folder of EasyMocap's files that `reconstruct` wrote, or empty: triangulated
/// when it is asked for
nlohmann::ordered_json put_capture(ViewPage& page, Dataset dataset,
                                   std::filesystem::path keypoints3d,
                                   const std::vector<int>& frame_ids, const std::string& folder,
                                   const ViewPageOptions& options);

/// An image file as an address "data:image/...". PNG, JPEG, WebP as they are, others as PNG. Throws
/// DataError, EnvironmentError.
std::string image_address(const std::filesystem::path& file);

}  // namespace atelier

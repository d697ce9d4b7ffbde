#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// Goliath and Ava-256 (facebookresearch/goliath, ca_code/utils/dataloader.py):
/// camera_calibration.json with KRT, `image/cam<ID>.zip` and `segmentation_parts/cam<ID>.zip` (28
/// classes), keypoints_3d/. K and T are stored transposed; K is of the full size, images are
/// often half of it; millimetres; the first pixel's centre at (0, 0). Cameras without a zip are
/// left out.
std::string recognize_goliath(const std::filesystem::path& path);
Dataset read_goliath(const std::filesystem::path& path, const DatasetOptions& options,
                     const Limits& limits);
std::vector<std::string> write_goliath(const LayoutSource& source,
                                       const std::filesystem::path& out);

/// The cameras, in the layout's world, of no size. Throws DataError for JSON that is no KRT, and
/// for K that is not transposed.
std::vector<Camera> parse_goliath_cameras(std::string_view text, const std::string& file = "",
                                          const Limits& limits = {});

}  // namespace atelier

#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// AvatarReX and THuman4.0 (lizhe00/AnimatableGaussians, AVATARREX_DATASET.md):
/// calibration_full.json with K, R, T, imgSize (and distCoeff) for each camera, `<camera>/%08d.jpg`
/// and `<camera>/mask/pha/`; THuman4: calibration.json, `images/<camera>/`, `masks/<camera>/`.
/// Camera from world, metres, the first pixel's centre at (0, 0). Frames of missing_img_files.txt
/// are not there.
std::string recognize_avatarrex(const std::filesystem::path& path);
std::string recognize_thuman4(const std::filesystem::path& path);
Dataset read_avatarrex(const std::filesystem::path& path, const DatasetOptions& options,
                       const Limits& limits);
Dataset read_thuman4(const std::filesystem::path& path, const DatasetOptions& options,
                     const Limits& limits);
std::vector<std::string> write_avatarrex(const LayoutSource& source,
                                         const std::filesystem::path& out);
std::vector<std::string> write_thuman4(const LayoutSource& source,
                                       const std::filesystem::path& out);

/// The cameras, in the layout's world. Throws DataError for JSON that is no such calibration.
std::vector<Camera> parse_avatarrex_cameras(std::string_view text, const std::string& file = "",
                                            const Limits& limits = {});

}  // namespace atelier

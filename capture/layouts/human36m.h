#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// Human3.6M's calibration as karfly/human36m-camera-parameters has it: camera-parameters.json with
/// intrinsics for each camera and extrinsics for each subject and camera (--subject). Camera from
/// world, millimetres, Z up, the first pixel's centre at (0, 0), 50 frames per second. Images in
/// `images/<camera>/` or `videos/<camera>.mp4`.
std::string recognize_human36m(const std::filesystem::path& path);
Dataset read_human36m(const std::filesystem::path& path, const DatasetOptions& options,
                      const Limits& limits);
std::vector<std::string> write_human36m(const LayoutSource& source,
                                        const std::filesystem::path& out);

/// The cameras of one subject ("auto": the first by name), in the layout's world, of no size.
/// Throws DataError for JSON that is no such calibration and for a subject that it does not have.
std::vector<Camera> parse_human36m_cameras(std::string_view text, const std::string& subject,
                                           const std::string& file = "", const Limits& limits = {});

}  // namespace atelier

#pragma once

#include "capture/layouts/layout.h"

namespace atelier {

/// Images and nothing else: a folder, zip or video for each camera, below images/, videos/ or the
/// folder itself; masks/ and keypoints as OpenPose writes them in keypoints2d/, pose/ or openpose/
/// where they are. Not calibrated.
std::string recognize_images(const std::filesystem::path& path);
Dataset read_images(const std::filesystem::path& path, const DatasetOptions& options,
                    const Limits& limits);
std::vector<std::string> write_images(const LayoutSource& source, const std::filesystem::path& out);

}  // namespace atelier

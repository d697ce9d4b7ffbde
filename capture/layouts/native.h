#pragma once

#include "capture/layouts/layout.h"

namespace atelier {

/// The native layout (docs/reference/formats.md): capture.toml, cameras.json, images/, labels/,
/// keypoints2d/. Not supported: 3D keypoints, masks beside labels (masks alone become labels of
/// which only the background is known), images that are neither PNG nor JPEG (they become PNG),
/// more than the options that capture.toml names.
std::string recognize_native(const std::filesystem::path& path);
Dataset read_native(const std::filesystem::path& path, const DatasetOptions& options,
                    const Limits& limits);
std::vector<std::string> write_native(const LayoutSource& source, const std::filesystem::path& out);

}  // namespace atelier

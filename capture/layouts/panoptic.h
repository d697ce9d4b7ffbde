#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// CMU Panoptic (domedb.perception.cs.cmu.edu): `calibration_<sequence>.json`, `hdImgs/<camera>/`
/// `<camera>_%08d.jpg` or `hdVideos/hd_<camera>.mp4` (the same of vga and kinect),
/// hdPose3d_stage1_coco19/ body3DScene_%08d.json. World: centimetres, Y down; the first pixel's
/// centre at (0, 0); 29.97 frames per second.
std::string recognize_panoptic(const std::filesystem::path& path);
Dataset read_panoptic(const std::filesystem::path& path, const DatasetOptions& options,
                      const Limits& limits);
std::vector<std::string> write_panoptic(const LayoutSource& source,
                                        const std::filesystem::path& out);

/// The cameras, in the layout's world. Throws DataError for JSON that is no such calibration.
std::vector<Camera> parse_panoptic_cameras(std::string_view text, const std::string& file = "",
                                           const Limits& limits = {});

}  // namespace atelier

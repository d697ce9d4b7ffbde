#pragma once

#include <string_view>
#include <vector>

#include "capture/layouts/layout.h"

namespace atelier {

/// nerfstudio and NeRF (docs/quickstart/data_conventions.md): transforms.json (NeRF:
/// transforms_train.json) with a world-from-camera matrix for each image, intrinsics for all or
/// for each (fl_x ... or camera_angle_x), masks. World: Z up, arbitrary unit; camera x right, y up,
/// z back; pixels as ours. Models OPENCV, OPENCV_FISHEYE, PINHOLE, SIMPLE_PINHOLE. A camera or a
/// frame all of whose images are held out is so; others that are cannot be told, which is a
/// finding.
std::string recognize_nerfstudio(const std::filesystem::path& path);
Dataset read_nerfstudio(const std::filesystem::path& path, const DatasetOptions& options,
                        const Limits& limits);
std::vector<std::string> write_nerfstudio(const LayoutSource& source,
                                          const std::filesystem::path& out);

/// One entry of `frames`.
struct NerfFrame {
  std::string file_path;
  std::string mask_path;  ///< "": none
  Camera camera;          ///< in the layout's world, without id; width 0: not said
  bool held_out = false;  ///< in val_filenames or test_filenames, and not in train_filenames
};

/// Throws DataError for JSON that is no such file, matrices whose last row is not 0 0 0 1,
/// intrinsics that are missing, masks of some images alone.
std::vector<NerfFrame> parse_transforms(std::string_view text, const std::string& file = "",
                                        const Limits& limits = {});

}  // namespace atelier

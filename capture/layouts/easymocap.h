#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// EasyMocap and ZJU-MoCap (zju3dv/EasyMocap, doc/quickstart.md): intri.yml and extri.yml of
/// OpenCV, `images/<camera>/%06d.jpg` or `videos/<camera>.mp4` (ZJU: `<camera>/` itself), mask*/ of
/// the person (mask_cihp: labels of CIHP), annots/ or openpose/ for detections, keypoints3d/.
/// World: metres, Z up; the first pixel's centre at (0, 0). ZJU's annots.npy is a Python pickle and
/// is not read.
std::string recognize_easymocap(const std::filesystem::path& path);
Dataset read_easymocap(const std::filesystem::path& path, const DatasetOptions& options,
                       const Limits& limits);
std::vector<std::string> write_easymocap(const LayoutSource& source,
                                         const std::filesystem::path& out);

/// The cameras of intri.yml and extri.yml, in the layout's world. A camera must be in both; `R_`
/// and `Rot_` must agree to 1e-3 (readers of this layout use one or the other). Throws DataError
/// for anything else.
std::vector<Camera> parse_easymocap_cameras(std::string_view intrinsics,
                                            std::string_view extrinsics,
                                            const std::string& file = "",
                                            const Limits& limits = {});

}  // namespace atelier

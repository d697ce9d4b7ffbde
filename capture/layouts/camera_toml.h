#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// Three tools that write a table of TOML for each camera: Pose2Sim (`Calib*.toml`, world Z up,
/// rotation vectors), Caliscope (`camera_array.toml` with [cameras.0], or config.toml with [cam_0];
/// rotation matrices), anipose (`calibration.toml`, rotation vectors). All: metres, camera from
/// world, the first pixel's centre at (0, 0), k1 k2 p1 p2 (k3), `fisheye` with four. Beside it
/// videos/, images/, `pose/<camera>_json/`. FreeMoCap's `<recording>_camera_calibration.toml` is
/// anipose's in millimetres, beside synchronized_videos/.
std::string recognize_pose2sim(const std::filesystem::path& path);
std::string recognize_caliscope(const std::filesystem::path& path);
std::string recognize_anipose(const std::filesystem::path& path);
Dataset read_pose2sim(const std::filesystem::path& path, const DatasetOptions& options,
                      const Limits& limits);
Dataset read_caliscope(const std::filesystem::path& path, const DatasetOptions& options,
                       const Limits& limits);
Dataset read_anipose(const std::filesystem::path& path, const DatasetOptions& options,
                     const Limits& limits);
std::vector<std::string> write_pose2sim(const LayoutSource& source,
                                        const std::filesystem::path& out);
std::vector<std::string> write_caliscope(const LayoutSource& source,
                                         const std::filesystem::path& out);
std::vector<std::string> write_anipose(const LayoutSource& source,
                                       const std::filesystem::path& out);

/// A data set with the frames that Pose2Sim's folders hold beside its calibration: images/ or
/// videos/ (recordings/), and the detections of pose*/.
Dataset with_pose2sim_frames(Dataset dataset, const Limits& limits = {});

/// The cameras of such a file, in its world.
struct CameraToml {
  std::vector<Camera> cameras;
  std::vector<Finding> findings;  ///< cameras that are ignored or have no pose are left out
};

/// Throws DataError for bad TOML, no camera, matrices of other sizes, sizes that are no whole
/// numbers, numbers that are not finite.
CameraToml parse_camera_toml(std::string_view text, const std::string& file = "",
                             const Limits& limits = {});

}  // namespace atelier

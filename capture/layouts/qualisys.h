#pragma once

#include <string_view>

#include "capture/layouts/layout.h"

namespace atelier {

/// Qualisys QTM's calibration (`*.qca.txt`, XML): one `<camera serial>` with `<fov_video>`,
/// `<transform>` (rows r11 r12 r13 ... and the camera's position, millimetres) and `<intrinsic>` in
/// sixty-fourths of a pixel. Beside it videos/ and pose/ as Pose2Sim has them. World: Z up.
///
/// The rows of QTM's transform are the camera's axes in the world, with y up and z back: the second
/// and third change their sign to become ours. So read, the QTM file of the Pose2Sim demo gives the
/// poses of its converted TOML to 1e-12 m.
std::string recognize_qualisys(const std::filesystem::path& path);
Dataset read_qualisys(const std::filesystem::path& path, const DatasetOptions& options,
                      const Limits& limits);
std::vector<std::string> write_qualisys(const LayoutSource& source,
                                        const std::filesystem::path& out);

/// The cameras of such a file, in its world.
struct QualisysRig {
  std::vector<Camera> cameras;
  std::vector<int> view_rotation;  ///< of each: degrees by which QTM shows and exports it turned
};

/// Throws DataError for what is no such XML, missing or doubled attributes, numbers that are not
/// finite, turns that are no quarters, no camera.
QualisysRig parse_qualisys(std::string_view text, const std::string& file = "",
                           const Limits& limits = {});

}  // namespace atelier

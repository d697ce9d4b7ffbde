#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace atelier {

/// The runs of digits of a file's name without its folder and extension.
std::vector<std::string_view> digit_runs(std::string_view file_name);

/// A run of digits as a number; nothing beyond 64 bits.
std::optional<std::int64_t> long_number(std::string_view digits);

/// The last number of a file's name without its extension: 81 of "cam01.0081.json", 3 of
/// "Cam001_rgb000003.jpg", 12 of "000012_keypoints.json"; with `from_end` 1 the one before it, and
/// so on. Nothing without digits or beyond 9 digits.
std::optional<int> frame_number(std::string_view file_name, std::size_t from_end = 0);

/// Whether the digits at the end of a name are a camera's: "000012_cam04", "f12-view_3".
bool is_camera_number(std::string_view file_name, std::string_view digits);

}  // namespace atelier

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
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

/// Digits of that number as they stand there, leading zeros too; 0 where there is none.
std::size_t number_digits(std::string_view file_name, std::size_t from_end = 0);

/// Numbers of one camera's counter that has begun again behind 9999, or behind nines of its whole
/// width, go on behind them: "DSC09999.JPG" is before "DSC00001.JPG" where the camera has numbers
/// at both ends of the range, in rows, and nothing in half of it. The first of the new round is
/// next to the last of the old, whether the counter begins at 0 or, as cameras' do (DCF 2.0), at 1.
/// @param numbers  (number, anything) sorted; sorted by the new numbers then
/// @param digits   of the longest number, as it is written
void continue_counter(std::vector<std::pair<int, std::uint32_t>>& numbers, std::size_t digits);

/// Whether the digits at the end of a name are a camera's: "000012_cam04", "f12-view_3".
bool is_camera_number(std::string_view file_name, std::string_view digits);

}  // namespace atelier

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace atelier {

/// The times that the names of one folder's files say, where they say times and no numbers of
/// frames; nothing of a name that says none. Nanoseconds since 1970 of
///  - seconds with a fraction, "1305031102.175304.png", as ROS and TUM's recordings have them,
///  whose
///    fraction alone is no frame's number;
///  - a date and a time of day at the end: "2026-11-29_14-26-01.000.jpg",
///  "2026-11-29T14:26:01.png",
///    "cam2_20261129_142601_033.png", "20261129142601.png". Not six digits behind a date alone,
///    which number frames as well; not where all are of one second and count on by one behind it,
///    which is when the recording began; not where all end in one number, which is a camera's.
std::vector<std::optional<std::int64_t>> time_stamps(const std::vector<std::string>& names);

}  // namespace atelier

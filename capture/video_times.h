#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/finding.h"
#include "core/limits.h"
#include "core/types.h"

namespace atelier {

/// When the images of a video are shown.
struct VideoTimes {
  std::vector<std::int64_t> ticks;    ///< [N] increasing, on the file's own clock, from its start
  std::int64_t ticks_per_second = 0;  ///< > 0
  std::int64_t hidden = 0;            ///< images that are stored and not shown: of a trimmed video
};

/// Reads when the images of an MP4 or MOV are shown, from the tables of its first video track (ISO
/// 14496-12: 8.6.1 times of decoding and of composition, 8.6.6 edit lists), without its images:
/// what a trimmed video hides does not count, and a late start is kept. Nothing for other files and
/// those without such tables.
///
/// Throws DataError for tables that are damaged or beyond `limits.frames`, and, with the command
/// that mends it, for images in fragments, of which no table says how many there are, and edit
/// lists of several parts or of another speed, whose images are no longer one after the other.
std::optional<VideoTimes> read_video_times(std::span<const std::byte> bytes,
                                           const std::string& name, const Limits& limits = {});
std::optional<VideoTimes> read_video_times(const std::filesystem::path& path,
                                           const Limits& limits = {});

/// How the images of a video follow one another.
struct VideoPace {
  double fps = 0;        ///< images a second, where none is missing; 0 of a single image
  double start = 0;      ///< s, of the first image
  Index missing = 0;     ///< images that a pause of two intervals and more has no room for
  Index first_gap = -1;  ///< the image behind the first such pause; -1: none
  Index uneven = -1;     ///< the first that is a quarter of an interval and more off the others'
                         ///< pace; -1: none
};
VideoPace video_pace(const VideoTimes& times);

/// What a reader by numbers should know: images that are missing or come unevenly
/// ("video-frames-missing", "video-uneven"). @param place  file or camera, for the findings
std::vector<Finding> video_findings(const VideoTimes& times, const std::string& place);

}  // namespace atelier

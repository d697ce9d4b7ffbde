#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/dataset.h"
#include "capture/frame_number.h"
#include "core/limits.h"

namespace atelier {

/// Which number of the names of one camera's files is the frame's, counted from the end: the last,
/// unless a camera's name is before it ("000012_cam04"), or it is the same in several and an
/// earlier one is not.
std::size_t frame_run(const std::vector<std::string>& names);

/// The files of a folder by frame_number, of the given extensions (small letters, with dot; any of
/// the images that we read where none is given). None if there is no such folder. Throws
/// DataError for two files of one number, for more files than `limits.frames`, for a file in the
/// folder's place or above it and for a folder in the place of a frame's file; EnvironmentError
/// (the folder that refuses) where it may not be looked at.
FrameLocations numbered_files(const std::filesystem::path& folder,
                              const std::vector<std::string>& extensions = {},
                              const Limits& limits = {});

/// Files of one folder that are named by time stamps, in the unit of the names.
struct StampedFiles {
  struct File {
    std::int64_t stamp = 0;
    std::string name;
  };
  std::filesystem::path folder;
  std::vector<File> files;  ///< by stamp, each stamp once
};

/// The files of a folder whose names say times (time_stamp.h), in nanoseconds, or whose last number
/// has 10 digits and more. Throws as numbered_files.
StampedFiles stamped_files(const std::filesystem::path& folder,
                           const std::vector<std::string>& extensions = {},
                           const Limits& limits = {});

/// The images of one camera: of the folder `base`/`name`, else of the zip `base`/`name`.zip, else
/// of the video `base`/`name`.mp4 (.mov, .avi, .mkv, .m4v, .webm), extensions in any case. None if
/// nothing is there. Throws as numbered_files, ZipArchive and VideoFile.
FrameLocations camera_pictures(const std::filesystem::path& base, const std::string& name,
                               const Limits& limits = {});

/// Names of the cameras that have a folder, a zip or a video in `base`, sorted; none if there is no
/// such folder. Hidden names and lost+found are left out. Throws EnvironmentError where it may not
/// be looked at.
std::vector<std::string> camera_names(const std::filesystem::path& base, const Limits& limits = {});

/// Files of a folder whose name ends in `suffix` (any case), sorted. Throws as camera_names.
std::vector<std::filesystem::path> files_ending(const std::filesystem::path& folder,
                                                std::string_view suffix, const Limits& limits = {});

/// Which of `names` each camera's files go by: the same name; else the one with the same last
/// number
/// ("1", "01", "cam1", "Camera_B1"); else, where as many names are left as cameras, in sorted
/// order.
struct MatchedNames {
  std::vector<std::string> names;  ///< one for each id; "": none
  bool by_number = false;          ///< some were matched by number
  bool by_order = false;           ///< some were matched by order alone
};
MatchedNames matched_names(const std::vector<std::string>& ids,
                           const std::vector<std::string>& names);

/// A data set with the images of `base` (camera_pictures) as its images, masks or labels; cameras
/// that have some already keep them. Files that are named by time stamps are numbered by them
/// (number_by_time). Findings say how names were matched.
Dataset with_pictures(Dataset dataset, FrameLocations CameraFrames::*kind,
                      const std::filesystem::path& base, const Limits& limits = {});

/// The same with the JSON files of `base/<camera>` as its keypoints: one for each frame, or one of
/// all frames (parse_detection_frames), which may also be `base/<camera>.json`.
Dataset with_keypoints(Dataset dataset, const std::filesystem::path& base,
                       const Limits& limits = {});

/// A data set without the cameras that have no images, where some have: calibrations often list
/// more cameras than were downloaded. A finding says how many.
Dataset with_pictured_cameras(Dataset dataset);

/// A path that a file names, under `root`. Throws DataError (`file`, `where`) unless it is
/// relative, without "..", empty parts and control characters, at most 1,024 bytes.
std::filesystem::path path_under(const std::filesystem::path& root, const std::string& name,
                                 const std::string& file, const std::string& where);

/// An id of the letters that the native layout allows (is_plain_name): others become '_'.
std::string plain_name(std::string_view name);

}  // namespace atelier

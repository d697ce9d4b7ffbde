#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/limits.h"
#include "core/plain_name.h"
#include "core/store/consent.h"

namespace atelier {

/// Frames that were taken in one go, in one outfit.
struct CaptureSequence {
  std::string name;            ///< of [A-Za-z0-9._-]
  std::string kind;            ///< "minimal" (the body in tight clothing) or "clothed"
  double fps = 0;              ///< frames per second, > 0
  std::vector<int> frame_ids;  ///< increasing, >= 0; no id is in two sequences
};

/// Metadata of a native capture: capture.toml (docs/reference/formats.md).
struct CaptureInfo {
  std::string subject;  ///< name or pseudonym
  std::vector<CaptureSequence> sequences;
  std::string keypoint_schema = "body_25";    ///< of keypoints2d/
  std::string label_taxonomy = "atelier";     ///< of labels/
  std::vector<std::string> held_out_cameras;  ///< no stage but evaluate opens their images
  std::vector<int> held_out_frames;           ///< no training sees them
  bool synthetic = false;                     ///< there is truth/
  std::string image_format = "png";           ///< extension of images: "png" or "jpg"
  std::vector<Consent> consent;
};

/// Throws DataError (with `file` as its file) unless names are of [A-Za-z0-9._-], texts can be
/// shown, kinds are known, rates positive, frame ids increasing and unique, held-out frames exist,
/// consent says whose and for what, and there is a sequence.
void check_capture_info(const CaptureInfo& info, const std::string& file = "");

/// The text of capture.toml, and back. Throws DataError for what check_capture_info refuses,
/// missing or unknown keys, other units than metres, another up axis than y.
std::string capture_toml(const CaptureInfo& info);
CaptureInfo parse_capture_toml(const std::string& text, const std::string& file = "",
                               const Limits& limits = {});

/// Reads `folder`/capture.toml. A folder without it is no finished capture: DataError.
CaptureInfo read_capture_info(const std::filesystem::path& folder, const Limits& limits = {});

}  // namespace atelier

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "capture/capture_info.h"
#include "capture/frame_locations.h"
#include "core/camera.h"
#include "core/finding.h"
#include "core/types.h"

namespace atelier {

/// Corrections of a camera's detections where files are wrong (layouts/corrections.h).
struct KeypointReading {
  double scale_x = 1;          ///< pixels of the image per unit of the file, across
  double scale_y = 1;          ///< the same down
  double confidence = 1;       ///< factor
  bool mirrored = false;       ///< the detector was given the mirrored image
  bool upside_down = false;    ///< rows were counted from below
  bool swapped_sides = false;  ///< left and right are exchanged
  int turn = 0;  ///< quarter turns, clockwise, of the images that the detector was given

  bool operator==(const KeypointReading&) const = default;
};

/// Data of one camera, by frame id.
struct CameraFrames {
  FrameLocations images;
  FrameLocations masks;         ///< of the person
  FrameLocations labels;        ///< of CaptureInfo::label_taxonomy
  FrameLocations keypoints;     ///< of CaptureInfo::keypoint_schema
  KeypointReading reading;      ///< of the keypoints
  bool inverted_masks = false;  ///< the masks are set in the background
  int turn = 0;  ///< quarter turns, clockwise, that images were given after the calibration
  bool turn_is_given = false;  ///< by --capture.turned, also if it is none
  int view_rotation = 0;       ///< degrees by which the recorder says that it turned them; 0: none
  int image_width = 0;         ///< pixels of the first readable image; 0: none
  int image_height = 0;
  int image_orientation = 1;  ///< of its EXIF; 1: shown as it is stored
};

/// Format of a layout's detections.
enum class KeypointFile { OpenPose, EasyMocap, Rows };

/// Unit and up axis of the calibration in a layout's files. A Dataset is in metres, Y up.
struct WorldConvention {
  double metres_per_unit = 0;  ///< 0: the layout does not say
  std::string up;              ///< "y", "z", "-y", ...; "": the layout does not say
  bool up_guessed = false;     ///< nobody says it; y is taken
};

/// Index of a capture in any layout. `open_dataset` (layouts/open_dataset.h) reads calibrations and
/// the headers of a few images only; `FrameReader` (frame_reader.h) opens the frames. Cameras are
/// in our conventions (core/camera.h): metres, Y up, first pixel's centre at (0.5, 0.5).
struct Dataset {
  std::string layout;    ///< "native", "easymocap", ...: layout_names() (layouts/write_layout.h)
  std::string evidence;  ///< how the layout was recognised, one sentence
  std::filesystem::path root;  ///< its folder
  CaptureInfo info;            ///< subject, sequences (fps, frame ids), schemas, held-out, consent
  bool calibrated = true;      ///< false: cameras have ids and sizes alone (fx, fy are 0)
  std::vector<Camera> cameras;
  std::vector<CameraFrames> frames;  ///< one for each camera
  FrameLocations keypoints3d;        ///< optional, by frame id
  std::string keypoint_schema_3d;    ///< of keypoints3d
  KeypointFile keypoint_file = KeypointFile::OpenPose;
  double keypoint_shift = 0;  ///< px, added to the files' coordinates: 0.5 if centres are integers
  WorldConvention world_convention;       ///< unit and up axis that were assumed for the files
  std::vector<std::int64_t> frame_times;  ///< of frames by index, where files are named by time
  double frame_interval = 0;              ///< median of them
  std::map<std::string, std::string> corrections;  ///< those that were asked for, as typed
  std::vector<Finding> findings;  ///< contradictions, missing statements and skipped data
};

/// Index of the camera with that id; -1 if there is none.
Index camera_index(const Dataset& dataset, const std::string& id);

/// Every frame id of every sequence, increasing.
std::vector<int> frame_ids(const Dataset& dataset);

/// Adds those of `more` that `frames` does not have; both are increasing.
void add_frames(std::vector<int>& frames, const std::vector<int>& more);

}  // namespace atelier

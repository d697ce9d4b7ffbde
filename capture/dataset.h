#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "capture/capture_info.h"
#include "core/camera.h"
#include "core/finding.h"
#include "core/types.h"

namespace atelier {

/// Where one image, mask, label image or detection lies.
struct DataPlace {
  std::filesystem::path file;  ///< a file of its own, a zip, a video, an HDF5 file
  std::string member;          ///< name inside a zip or an HDF5 file; "": the file itself
  int index = -1;              ///< frame of a video or row of an array, from 0; -1: neither

  bool operator==(const DataPlace&) const = default;
};

/// How a camera's detections are meant where files say it wrongly (layouts/corrections.h).
struct KeypointReading {
  double scale_x = 1;          ///< px of the image for each of the file's
  double scale_y = 1;          ///< the same down
  double confidence = 1;       ///< factor
  bool mirrored = false;       ///< the image was mirrored when it was looked at
  bool upside_down = false;    ///< rows were counted from below
  bool swapped_sides = false;  ///< left is right

  bool operator==(const KeypointReading&) const = default;
};

/// What there is of one camera, by frame id.
struct CameraFrames {
  std::map<int, DataPlace> images;
  std::map<int, DataPlace> masks;      ///< of the person
  std::map<int, DataPlace> labels;     ///< of CaptureInfo::label_taxonomy
  std::map<int, DataPlace> keypoints;  ///< of CaptureInfo::keypoint_schema
  KeypointReading reading;             ///< of the keypoints
  bool inverted_masks = false;         ///< the masks are set where nobody is
  int image_width = 0;                 ///< pixels of the first that can be read; 0: none can
  int image_height = 0;
};

/// How a layout writes detections down.
enum class KeypointFile { OpenPose, EasyMocap, Rows };

/// The world of a layout's calibration: the one of a Dataset is metres, Y up.
struct FileWorld {
  double metres_per_unit = 0;  ///< 0: the layout does not say
  std::string up;              ///< "y", "z", "-y", ...; "": the layout does not say
};

/// A capture as its files describe it, in any layout: an index. Nothing but calibrations and the
/// headers of a few images is read (`open_dataset`, layouts/open_dataset.h); `FrameReader`
/// (frame_reader.h) opens the frames. Cameras are
/// in our conventions (core/camera.h): metres, Y up, first pixel's centre at (0.5, 0.5).
struct Dataset {
  std::string layout;    ///< "native", "easymocap", ...: layout_names() (layouts/write_layout.h)
  std::string evidence;  ///< what the layout was told by, one sentence
  std::filesystem::path root;  ///< its folder
  CaptureInfo info;            ///< subject, sequences (fps, frame ids), schemas, held-out, consent
  bool calibrated = true;      ///< false: cameras have ids and sizes alone (fx, fy are 0)
  std::vector<Camera> cameras;
  std::vector<CameraFrames> frames;      ///< one for each camera
  std::map<int, DataPlace> keypoints3d;  ///< optional, by frame id
  std::string keypoint_schema_3d;        ///< of keypoints3d
  KeypointFile keypoint_file = KeypointFile::OpenPose;
  double keypoint_shift = 0;  ///< px, added to what the files say: 0.5 where centres are integers
  FileWorld file_world;       ///< what the files' own world was taken for
  std::vector<Finding> findings;  ///< what the layout contradicts, leaves open or leaves out
};

/// Place of the camera of that id; -1 if there is none.
Index camera_index(const Dataset& dataset, const std::string& id);

/// Every frame id of every sequence, increasing.
std::vector<int> frame_ids(const Dataset& dataset);

}  // namespace atelier

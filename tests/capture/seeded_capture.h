#pragma once

#include <filesystem>
#include <vector>

#include "capture/capture_info.h"
#include "capture/keypoints2d.h"
#include "core/camera.h"
#include "core/image.h"
#include "core/types.h"
#include "tests/capture/circle_of_cameras.h"

namespace atelier::fixtures {

/// What a good capture is made with.
struct SeededRig {
  CircleOfCameras circle;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3
  int frames = 15;
  double fps = 30;
  double stature = 1.7;    ///< m
  std::uint64_t seed = 1;  ///< of noise, colours and gait
  bool pictures = true;    ///< and masks and labels; else calibrations and detections alone
  double noise = 2.5;      ///< px at 1000 rows, of detections
};

/// A good capture in memory, as a native capture holds it, to be spoiled and written.
struct SeededCapture {
  CaptureInfo info;
  std::vector<Camera> cameras;
  std::vector<std::vector<Keypoints2d>> keypoints;  ///< [camera][frame]
  std::vector<std::vector<ByteImage>> pictures;     ///< the same, or none
  std::vector<std::vector<ByteImage>> masks;        ///< the same, or none
  std::vector<std::vector<ByteImage>> labels;       ///< of LIP, the same, or none
};

/// Joints of BODY_25 of somebody who walks and swings the arms, metres, at a time in frames.
Points walking_person(const SeededRig& rig, double frame);

/// Three rigs that have little in common: images upright and lying, lenses without and with
/// distortion, near and far, and one of detections alone in images of 1000 rows.
std::vector<SeededRig> seeded_rigs();

SeededCapture seeded_capture(const SeededRig& rig);

/// The detections of a camera, once more, with the person as it was `later` frames later: a camera
/// out of step.
std::vector<Keypoints2d> seeded_detections(const SeededRig& rig, const Camera& camera,
                                           std::size_t camera_idx, double later = 0, int from = 0);

/// Image, labels (LIP) of a camera at a time in frames.
struct SeededPicture {
  ByteImage picture;
  ByteImage labels;
};
SeededPicture seeded_picture(const SeededRig& rig, const Camera& camera, std::size_t camera_idx,
                             double frame);

/// Writes it as a native capture.
void write_seeded(const SeededCapture& capture, const std::filesystem::path& folder);

}  // namespace atelier::fixtures

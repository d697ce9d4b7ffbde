#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/capture_info.h"
#include "capture/dome.h"
#include "capture/keypoint_schema.h"
#include "capture/keypoints2d.h"
#include "core/atomic_file.h"
#include "core/io/cameras_file.h"
#include "core/io/ground_truth_archive.h"
#include "core/io/image_file.h"

namespace atelier::fixtures {

/// What a small native capture is made with.
struct SmallCapture {
  std::vector<Camera> cameras =
      dome_cameras({.cameras = 3, .pairs = false, .width = 64, .height = 80, .gain = 0}, {1, 1});
  std::vector<int> frames = {3, 4};
  std::string extension = ".png";
  bool detections = true;  ///< two people in each image
  std::vector<Consent> consent;
};

/// Two standing people in BODY_25: no two points are alike, the last of each is not found.
inline std::vector<PersonKeypoints> small_people(int frame) {
  // nose neck rsho relb rwri lsho lelb lwri hip rhip rkne rank lhip lkne lank eyes ears feet
  constexpr double kX[] = {0,   0.5, -6, -7, -8, 6, 7, 8, 0.25, -3, -3.5, -4, 3,
                           3.5, 4,   -1, 1,  -2, 2, 5, 6, 3.75, -5, -6,   0};
  constexpr double kY[] = {0,    6,    7,  15,    23,   7.5, 15.5, 23.5, 24, 24.5, 36,    48, 24.25,
                           36.5, 48.5, -1, -1.25, 0.25, 0.5, 51,   50.5, 50, 51.5, 51.25, 0};
  std::vector<PersonKeypoints> people;
  for (int person = 0; person < 2; ++person) {
    Keypoints2d points = Keypoints2d::Zero(25, 3);
    for (Index i = 0; i < 24; ++i) {
      points.row(i) << 10.25 + kX[i] + frame + 20 * person, 20.125 + kY[i] - person,
          0.5 + 0.01 * static_cast<double>(i);
    }
    people.push_back({person, points});
  }
  return people;
}

/// Writes it; a pixel of every image tells its camera and frame, labels have an upper garment.
inline void write_small_capture(const std::filesystem::path& folder,
                                const SmallCapture& capture = {}) {
  CaptureInfo info;
  info.subject = "somebody";
  info.image_format = capture.extension.substr(1);
  info.sequences = {{"clothed", "clothed", 12, capture.frames}};
  info.consent = capture.consent;
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    const Camera& camera = capture.cameras[c];
    for (const int frame : capture.frames) {
      const std::string name = frame_name(frame);
      for (const char* part : {"images", "labels", "keypoints2d"}) {
        make_private_directory(folder / part / camera.id);
      }
      ByteImage picture(camera.width, camera.height, 3, 40);
      picture.at(7, 9, 0) = static_cast<std::uint8_t>(100 + c);
      picture.at(7, 9, 1) = static_cast<std::uint8_t>(frame);
      write_image(folder / "images" / camera.id / (name + capture.extension), picture);
      ByteImage labels(camera.width, camera.height, 1);
      labels.at(5, 6) = 3;
      write_labels(folder / "labels" / camera.id / (name + ".png"), labels);
      if (capture.detections) {
        write_file_atomically(folder / "keypoints2d" / camera.id / (name + ".json"),
                              openpose_json(small_people(frame)));
      }
    }
  }
  write_file_atomically(folder / "cameras.json", cameras_json(capture.cameras));
  write_file_atomically(folder / "capture.toml", capture_toml(info));
}

}  // namespace atelier::fixtures

#include <fstream>

#include "capture/keypoint_schema.h"
#include "core/io/ground_truth_archive.h"
#include "tests/capture/in_schema.h"
#include "tests/capture/seeded_defects.h"

namespace atelier::fixtures {
namespace {

template <class Change>
void of_rows(Spoiled& spoiled, int camera, const Change& change) {
  for (std::size_t c = 0; c < spoiled.capture.keypoints.size(); ++c) {
    if (camera < 0 || static_cast<int>(c) == camera) {
      for (Keypoints2d& rows : spoiled.capture.keypoints[c]) {
        for (Index k = 0; k < rows.rows(); ++k) {
          if (!rows.row(k).isZero(0)) {
            change(rows, k, spoiled.capture.cameras[c]);
          }
        }
      }
    }
  }
}

void swap_sides(Spoiled& spoiled, int camera) {
  for (std::size_t c = 0; c < spoiled.capture.keypoints.size(); ++c) {
    if (camera < 0 || static_cast<int>(c) == camera) {
      for (Keypoints2d& rows : spoiled.capture.keypoints[c]) {
        const Keypoints2d before = rows;
        for (Index k = 0; k < rows.rows(); ++k) {
          rows.row(k) = before.row(body_25_schema().mirror[static_cast<std::size_t>(k)]);
        }
      }
    }
  }
}

void late(Spoiled& spoiled, std::size_t camera, double frames, int from = 0) {
  spoiled.capture.keypoints[camera] =
      seeded_detections(spoiled.rig, spoiled.capture.cameras[camera], camera, frames, from);
}

std::filesystem::path detection_file(const Spoiled& spoiled, const char* camera, int frame) {
  return spoiled.folder / "keypoints2d" / camera / (frame_name(frame) + ".json");
}

}  // namespace

void turn_upside_down(ByteImage& image) {
  const ByteImage before = image;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        image.at(x, y, c) = before.at(image.width - 1 - x, image.height - 1 - y, c);
      }
    }
  }
}

void turn_rows_upside_down(Keypoints2d& rows, const Camera& camera) {
  for (Index k = 0; k < rows.rows(); ++k) {
    if (!rows.row(k).isZero(0)) {
      rows(k, 0) = camera.width - rows(k, 0);
      rows(k, 1) = camera.height - rows(k, 1);
    }
  }
}

std::vector<SeededDefect> detection_defects() {
  return {
      {"detections of one camera in images turned by 180 degrees", "camera-turned", "cam1",
       "--capture.turned cam1=180", 2,
       [](Spoiled& s) {
         for (Keypoints2d& rows : s.capture.keypoints[1]) {
           turn_rows_upside_down(rows, s.capture.cameras[1]);
         }
       }},
      {"detections of every camera in images turned by 180 degrees", "camera-turned", "",
       "--capture.turned all=180", 2,
       [](Spoiled& s) {
         for (std::size_t c = 0; c < s.capture.cameras.size(); ++c) {
           for (Keypoints2d& rows : s.capture.keypoints[c]) {
             turn_rows_upside_down(rows, s.capture.cameras[c]);
           }
         }
       }},
      {"a camera 3 frames late", "camera-out-of-sync", "cam2", "--capture.sync cam2=3", 2,
       [](Spoiled& s) { late(s, 2, 3); }},
      {"a camera 2 frames early", "camera-out-of-sync", "cam6", "--capture.sync cam6=-2", 2,
       [](Spoiled& s) { late(s, 6, -2); }},
      {"a camera 4 frames early, small images", "camera-out-of-sync", "cam5",
       "--capture.sync cam5=-4", 0, [](Spoiled& s) { late(s, 5, -4); }},
      {"two cameras out of step", "camera-out-of-sync", "cam0", "--capture.sync cam0=4,cam3=-3", 2,
       [](Spoiled& s) {
         late(s, 0, 4);
         late(s, 3, -3);
       }},
      {"a camera that drops 4 frames half way", "camera-drops-frames", "cam4",
       "--capture.leave-out cam4", 2, [](Spoiled& s) { late(s, 4, 4, 12); }},
      {"left and right exchanged in one camera", "keypoint-sides", "cam3",
       "--capture.keypoints cam3=swapped_sides", 2, [](Spoiled& s) { swap_sides(s, 3); }},
      {"left and right exchanged in every camera", "keypoint-sides", "",
       "--capture.keypoints all=swapped_sides", 2, [](Spoiled& s) { swap_sides(s, -1); }},
      {"detections of mirrored images of one camera", "keypoints-mirrored", "cam1",
       "--capture.keypoints cam1=mirrored", 2,
       [](Spoiled& s) {
         swap_sides(s, 1);
         of_rows(s, 1, [](Keypoints2d& rows, Index k, const Camera& camera) {
           rows(k, 0) = camera.width - rows(k, 0);
         });
       }},
      {"detections with rows counted from below in one camera", "keypoints-upside-down", "cam0",
       "--capture.keypoints cam0=upside_down", 0,
       [](Spoiled& s) {
         of_rows(s, 0, [](Keypoints2d& rows, Index k, const Camera& camera) {
           rows(k, 1) = camera.height - rows(k, 1);
         });
       }},
      {"detections of images half as large in one camera", "keypoints-scaled", "cam7",
       "--capture.keypoints cam7=2", 2,
       [](Spoiled& s) {
         of_rows(s, 7,
                 [](Keypoints2d& rows, Index k, const Camera&) { rows.row(k).head<2>() /= 2; });
       }},
      {"detections of images half as large in every camera", "keypoints-scaled", "",
       "--capture.keypoints all=2", 2,
       [](Spoiled& s) {
         of_rows(s, -1,
                 [](Keypoints2d& rows, Index k, const Camera&) { rows.row(k).head<2>() /= 2; });
       }},
      {"detections of images twice as large in one camera", "keypoints-scaled", "cam2",
       "--capture.keypoints cam2=0.5", 1,
       [](Spoiled& s) {
         of_rows(s, 2,
                 [](Keypoints2d& rows, Index k, const Camera&) { rows.row(k).head<2>() *= 2; });
       }},
      {"detections as shares of width and height", "keypoints-scaled", "cam1",
       "--capture.keypoints cam1=shares", 2,
       [](Spoiled& s) {
         of_rows(s, 1, [](Keypoints2d& rows, Index k, const Camera& camera) {
           rows(k, 0) /= camera.width;
           rows(k, 1) /= camera.height;
         });
       }},
      {"confidences in percent", "keypoint-confidence", "cam4", "--capture.keypoints cam4=percent",
       2,
       [](Spoiled& s) {
         of_rows(s, 4, [](Keypoints2d& rows, Index k, const Camera&) { rows(k, 2) *= 100; });
       }},
      {"points of BODY_25B said to be BODY_25", "keypoint-schema", "",
       "--capture.keypoint-schema body_25b", 2,
       [](Spoiled& s) {
         const KeypointSchema& from = body_25_schema();
         const KeypointSchema& to = keypoint_schema("body_25b");
         for (auto& frames : s.capture.keypoints) {
           for (Keypoints2d& rows : frames) {
             rows = in_schema(rows, from, to);
           }
         }
       }},
      {"17 points of COCO said to be BODY_25", "keypoint-schema", "", "", 2,
       [](Spoiled& s) {
         for (auto& frames : s.capture.keypoints) {
           for (Keypoints2d& rows : frames) {
             rows = in_schema(rows, body_25_schema(), keypoint_schema("coco_17"));
           }
         }
       }},
      {"two points exchanged in every image", "keypoint-order", "", "", 2,
       [](Spoiled& s) {
         const int knee = find_keypoint(body_25_schema(), "left_knee");
         const int nose = find_keypoint(body_25_schema(), "nose");
         for (auto& frames : s.capture.keypoints) {
           for (Keypoints2d& rows : frames) {
             rows.row(knee).swap(rows.row(nose));
           }
         }
       }},
      {"one camera finds nobody", "keypoints-none", "cam5", "", 2,
       [](Spoiled& s) {
         for (Keypoints2d& rows : s.capture.keypoints[5]) {
           rows.setZero();
         }
       }},
      {"points beside the image", "keypoints-outside", "cam3", "", 0,
       [](Spoiled& s) {
         of_rows(s, 3, [](Keypoints2d& rows, Index k, const Camera& camera) {
           rows(k, 0) += k % 2 == 0 ? camera.width : 0;
         });
       }},
      {"a file of detections cut off", "keypoints-damaged", "cam2 frame 6", "", 2, nullptr,
       [](Spoiled& s) { std::filesystem::resize_file(detection_file(s, "cam2", 6), 90); }},
      {"detections of somebody else's day", "calibration-error", "", "", 2,
       [](Spoiled& s) {
         for (std::size_t c = 0; c < s.capture.keypoints.size(); ++c) {
           std::rotate(s.capture.keypoints[c].begin(),
                       s.capture.keypoints[c].begin() + static_cast<std::ptrdiff_t>(2 * c),
                       s.capture.keypoints[c].end());
           for (Keypoints2d& rows : s.capture.keypoints[c]) {
             for (Index k = 0; k < rows.rows(); ++k) {
               rows(k, 0) += 60.0 * static_cast<double>(c * c % 5) - 120;
               rows(k, 1) += 50.0 * static_cast<double>(c * 3 % 7) - 150;
             }
           }
         }
       }},
      {"only one camera sees the person", "coverage-low", "", "", 2,
       [](Spoiled& s) {
         for (std::size_t c = 0; c < s.capture.keypoints.size(); ++c) {
           for (Keypoints2d& rows : s.capture.keypoints[c]) {
             for (Index k = 0; k < rows.rows(); ++k) {
               if (c > 0 && k % 2 == 0) {
                 rows.row(k).setZero();
               }
             }
           }
         }
       }},
  };
}

}  // namespace atelier::fixtures

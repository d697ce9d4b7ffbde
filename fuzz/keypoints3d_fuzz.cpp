#include "capture/keypoints3d_file.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(keypoints3d) {
  for (const PersonPoints& person : parse_keypoints3d(as_text(bytes), "keypoints3d")) {
    ATELIER_CHECK(person.points.allFinite(), "points that are not finite");
  }
  for (const auto& [id, deviations] : parse_keypoint_deviations(as_text(bytes), "keypoints3d")) {
    for (const double deviation : deviations) {
      ATELIER_CHECK(deviation >= 0 && deviation < 1e9, "a deviation that is no length");
    }
  }
  for (const auto& [id, bridged] : parse_bridged_keypoints(as_text(bytes), "keypoints3d")) {
    for (const int point : bridged) {
      ATELIER_CHECK(point >= 0, "a point without a number");
    }
  }
}

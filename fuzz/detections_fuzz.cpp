#include "capture/keypoints2d.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(detections) {
  const std::string_view text = as_text(bytes);
  for (const auto& [frame, people] : parse_detection_frames(text, "detections", 0.5)) {
    ATELIER_CHECK(frame >= 0, "a negative frame");
    for (const PersonKeypoints& person : people) {
      ATELIER_CHECK(person.points.allFinite(), "points that are none");
    }
  }
}

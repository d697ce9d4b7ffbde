#include "capture/keypoints2d.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(openpose) {
  for (const PersonKeypoints& person : parse_openpose(as_text(bytes), "openpose", 0.5)) {
    ATELIER_CHECK(person.points.allFinite() && person.points.rows() > 0, "points that are none");
  }
}

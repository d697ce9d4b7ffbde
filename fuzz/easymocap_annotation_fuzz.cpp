#include "capture/keypoints2d.h"
#include "core/io/text_scanner.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(easymocap_annotation) {
  for (const PersonKeypoints& person : parse_easymocap_annotation(as_text(bytes), "annots")) {
    ATELIER_CHECK(person.points.allFinite(), "points that are not finite");
  }
}

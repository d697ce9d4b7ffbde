#include "bodymodel/formats/motion_c3d.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(c3d) {
  const atelier::MarkerClip clip = atelier::read_c3d(bytes, "c3d");
  ATELIER_CHECK(clip.positions.size() == clip.frame_ids.size(), "a frame without its points");
  for (const atelier::Points& frame : clip.positions) {
    ATELIER_CHECK(frame.allFinite(), "a position that is not finite");
  }
}

#include "bodymodel/formats/motion_trc.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(trc) {
  const atelier::MarkerClip clip = atelier::read_trc(bytes, "trc");
  for (const atelier::Points& frame : clip.positions) {
    ATELIER_CHECK(frame.allFinite(), "a position that is not finite");
  }
}

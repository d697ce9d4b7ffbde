#include "capture/layouts/panoptic.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(panoptic) {
  check_finite_cameras(parse_panoptic_cameras(as_text(bytes), "panoptic"));
}

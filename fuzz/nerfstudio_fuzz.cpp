#include "capture/layouts/nerfstudio.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(nerfstudio) {
  for (const NerfFrame& frame : parse_transforms(as_text(bytes), "transforms.json")) {
    check_finite_cameras({frame.camera});
  }
}

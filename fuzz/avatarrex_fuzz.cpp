#include "capture/layouts/avatarrex.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(avatarrex) {
  check_finite_cameras(parse_avatarrex_cameras(as_text(bytes), "avatarrex"));
}

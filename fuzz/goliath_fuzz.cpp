#include "capture/layouts/goliath.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(goliath) {
  check_finite_cameras(parse_goliath_cameras(as_text(bytes), "goliath"));
}

#include "capture/layouts/human36m.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(human36m) {
  check_finite_cameras(parse_human36m_cameras(as_text(bytes), "auto", "human36m"));
}

#include "capture/layouts/qualisys.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(qualisys) {
  check_finite_cameras(parse_qualisys(as_text(bytes), "qca").cameras);
}

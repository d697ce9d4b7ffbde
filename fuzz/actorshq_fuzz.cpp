#include "capture/layouts/actorshq.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(actorshq) {
  check_finite_cameras(parse_actorshq_cameras(as_text(bytes), "actorshq"));
}

#include "bodymodel/formats/makehuman_target.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(target) {
  const atelier::Blendshape shape = atelier::read_target(bytes, "target", 19'158);
  ATELIER_CHECK(shape.offsets.allFinite(), "an offset that is not finite");
}

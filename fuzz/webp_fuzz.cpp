#include "core/io/image_file.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(webp) {
  atelier::read_image(bytes, "webp", {.keep_alpha = true});
}

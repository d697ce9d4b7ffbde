#include "core/io/image_file.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(avif) {
  atelier::read_image(bytes, "avif", {.keep_alpha = true});
}

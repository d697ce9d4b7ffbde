#include "core/io/image_file.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(tiff) {
  atelier::read_image(bytes, "tiff", {.keep_alpha = true});
}

#include "core/io/image_file.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(bmp) {
  atelier::read_image(bytes, "bmp", {.keep_alpha = true});
}

#include "core/io/image_file.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(jpeg) {
  atelier::read_image(bytes, "jpeg", {.keep_alpha = true});
}

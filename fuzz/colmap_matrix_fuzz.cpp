#include "capture/layouts/colmap_dense.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(colmap_matrix) {
  const Image image = parse_colmap_matrix(bytes, "map.bin");
  ATELIER_CHECK(
      image.data.size() == static_cast<std::size_t>(image.width) * image.height * image.channels,
      "an image without all its values");
}

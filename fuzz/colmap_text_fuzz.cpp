#include "capture/layouts/colmap.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"
#include "fuzz/two_texts.h"

ATELIER_FUZZ_READER(colmap_text) {
  const auto [cameras, images] = two_texts(bytes);
  for (const auto& [id, camera] : parse_colmap_cameras_text(cameras, "cameras.txt")) {
    check_finite_cameras({camera});
  }
  for (const ColmapImage& image : parse_colmap_images_text(images, "images.txt")) {
    ATELIER_CHECK(image.camera_from_world_rotation.allFinite() && !image.name.empty(),
                  "an image without a pose or a name");
  }
}

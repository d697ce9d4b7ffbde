#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "capture/layouts/colmap.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

// The first four bytes say how many bytes of cameras.bin follow; the rest is images.bin.
ATELIER_FUZZ_READER(colmap_binary) {
  std::uint32_t cameras_bytes = 0;
  const std::size_t head = std::min(bytes.size(), sizeof(cameras_bytes));
  std::ranges::copy(bytes.first(head),
                    std::as_writable_bytes(std::span(&cameras_bytes, 1)).begin());
  bytes = bytes.subspan(head);
  const std::size_t count = std::min<std::size_t>(cameras_bytes, bytes.size());
  for (const auto& [id, camera] : parse_colmap_cameras_binary(bytes.first(count), "cameras.bin")) {
    check_finite_cameras({camera});
  }
  for (const ColmapImage& image : parse_colmap_images_binary(bytes.subspan(count), "images.bin")) {
    ATELIER_CHECK(image.camera_from_world_rotation.allFinite() &&
                      image.camera_from_world_translation.allFinite(),
                  "an image without a pose");
  }
}

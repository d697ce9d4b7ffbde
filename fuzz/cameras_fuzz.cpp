#include <string>
#include <vector>

#include "core/io/cameras_file.h"
#include "fuzz/reader.h"

/// What is read can be used and written, and then says the same.
ATELIER_FUZZ_READER(cameras) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::vector<atelier::Camera> cameras = atelier::parse_cameras_json(text, "cameras.json");
  for (const atelier::Camera& camera : cameras) {
    if (const auto pixel = atelier::project(camera, {0.1, 1.2, 0.3})) {
      ATELIER_CHECK(pixel->allFinite(), "a point in view that is nowhere");
    }
    if (const auto ray = atelier::ray_direction(camera, {0.5, 0.5})) {
      ATELIER_CHECK(ray->allFinite(), "a ray that leads nowhere");
    }
  }
  const std::string written = atelier::cameras_json(cameras);
  ATELIER_CHECK(atelier::cameras_json(atelier::parse_cameras_json(written, "written")) == written,
                "cameras read back to the same bits");
}

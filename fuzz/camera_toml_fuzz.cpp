#include "capture/layouts/camera_toml.h"
#include "core/io/text_scanner.h"
#include "fuzz/finite_cameras.h"
#include "fuzz/reader.h"

ATELIER_FUZZ_READER(camera_toml) {
  check_finite_cameras(parse_camera_toml(as_text(bytes), "toml").cameras);
}

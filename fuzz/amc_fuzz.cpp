#include <algorithm>

#include "bodymodel/formats/motion_amc.h"
#include "fuzz/reader.h"

// A skeleton and a motion in one file, parted by the first NUL byte.
ATELIER_FUZZ_READER(amc) {
  const auto cut = std::find(bytes.begin(), bytes.end(), std::byte{0});
  const std::size_t size = static_cast<std::size_t>(cut - bytes.begin());
  const std::span<const std::byte> motion =
      size < bytes.size() ? bytes.subspan(size + 1) : std::span<const std::byte>();
  const atelier::MotionClip clip = atelier::read_amc(bytes.first(size), "asf", motion, "amc");
  atelier::check_motion_clip(clip, "amc");
}

#pragma once

#include <filesystem>
#include <string>

#include "core/atomic_file.h"
#include "core/io/image_file.h"

namespace atelier::fixtures {

/// Writes an image as a JPEG whose EXIF has an orientation, 1 to 8.
inline void write_oriented(const std::filesystem::path& path, const ByteImage& image,
                           char orientation) {
  std::string jpeg = image_bytes(image, ImageFormat::Jpeg);
  const char exif[] = {'\xFF', '\xE1', 0, 34, 'E', 'x',         'i', 'f', 0, 0,  'M', 'M',
                       0,      42,     0, 0,  0,   8,           0,   1,   1, 18, 0,   3,
                       0,      0,      0, 1,  0,   orientation, 0,   0,   0, 0,  0,   0};
  jpeg.insert(2, std::string(exif, sizeof exif));
  write_file_atomically(path, jpeg);
}

/// The same of one grey.
inline void write_oriented(const std::filesystem::path& path, int width, int height,
                           char orientation) {
  write_oriented(path, ByteImage(width, height, 3, 90), orientation);
}

}  // namespace atelier::fixtures

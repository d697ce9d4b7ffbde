#pragma once

#include "core/image.h"
#include "core/render/video.h"

namespace atelier {

/// A video that is being written. Everything throws EnvironmentError.
struct VideoEncoder {
  virtual ~VideoEncoder() = default;
  /// @param image  sRGB, R G B; what it lacks to the size of the video repeats its edge
  virtual void add(const ByteImage& image, Index number) = 0;
  /// Writes what is left and closes the file.
  virtual void finish() = 0;
};

}  // namespace atelier

/// Of the late library `film`. The caller deletes what it gets.
///
/// @param path     name for errors
/// @param written  the file
/// @param width, height  pixels, even
extern "C" atelier::VideoEncoder* atelier_new_film(const std::filesystem::path& path,
                                                   const std::filesystem::path& written, int width,
                                                   int height,
                                                   const atelier::VideoOptions& options);

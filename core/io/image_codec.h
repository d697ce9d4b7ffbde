#pragma once

// The codecs behind image_file.h. Only core/io includes this.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "core/image.h"
#include "core/io/image_file.h"

namespace atelier {

/// Samples as they are stored, R G B (A) interleaved.
using Samples = std::variant<ByteImage, ImageOf<std::uint16_t>>;

/// Orientation of an EXIF block (a little TIFF file), 1 if it does not say.
int exif_orientation(std::span<const std::byte> exif);

ImageHeader read_png_header(std::span<const std::byte> bytes, const std::string& name);
ImageHeader read_jpeg_header(std::span<const std::byte> bytes, const std::string& name);
ImageHeader read_tiff_header(std::span<const std::byte> bytes, const std::string& name,
                             const Limits& limits);
ImageHeader read_webp_header(std::span<const std::byte> bytes, const std::string& name);
ImageHeader read_bmp_header(std::span<const std::byte> bytes, const std::string& name);
ImageHeader read_avif_header(std::span<const std::byte> bytes, const std::string& name,
                             const Limits& limits);

/// All decoders expect the header of the same bytes, already compared with the limits.
ByteImage decode_jpeg(std::span<const std::byte> bytes, const std::string& name,
                      const ImageHeader& header);

/// `raw`: palette indices and grey samples of less than 8 bits as they are, one byte each.
Samples decode_png(std::span<const std::byte> bytes, const std::string& name,
                   const ImageHeader& header, bool raw);

Samples decode_avif(std::span<const std::byte> bytes, const std::string& name,
                    const ImageHeader& header, const Limits& limits);

/// TIFF, WebP, BMP.
Samples decode_opencv(std::span<const std::byte> bytes, const std::string& name,
                      const ImageHeader& header);

std::string encode_png(const Samples& image);

/// PNG with a palette of 256 colours.
std::string encode_palette_png(const ByteImage& indices);

/// 1 or 3 channels.
std::string encode_jpeg(const ByteImage& image, int quality);

std::string encode_avif(const ByteImage& image, int quality);

/// TIFF, WebP, BMP.
std::string encode_opencv(const Samples& image, ImageFormat format, int quality);

}  // namespace atelier

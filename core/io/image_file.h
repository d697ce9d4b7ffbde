#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/image.h"
#include "core/limits.h"

namespace atelier {

/// PNG (8 and 16 bit, grey, RGB, with alpha or palette), JPEG (baseline and progressive; grey and
/// colour), TIFF (8 and 16 bit; uncompressed, PackBits, LZW, deflate), WebP, BMP and AVIF, told
/// apart by their first bytes, never by their name. OpenEXR is off on purpose (its decoders have a
/// long record of memory errors), as are CMYK, 12-bit and lossless JPEG, and animations.
enum class ImageFormat { Png, Jpeg, Tiff, WebP, Bmp, Avif };

/// "PNG" and so on.
const char* format_name(ImageFormat format);

/// Header of an image file, read without decoding.
struct ImageHeader {
  ImageFormat format = ImageFormat::Png;
  int width = 0;      ///< pixels
  int height = 0;     ///< pixels
  int channels = 0;   ///< after decoding: 1 grey, 2 grey and alpha, 3 RGB, 4 RGB and alpha
  int bit_depth = 0;  ///< of a sample in the file; of an index where there is a palette
  bool palette = false;
  /// EXIF 1..8; 1: as it is. Never applied: calibrations are made on the stored pixels. A validator
  /// reports files where it is not 1.
  int orientation = 1;
};

/// Reads the header alone, with our own parsers (AVIF: libavif's), and compares it with the limits:
/// side, pixels, bytes of the file, and decoded bytes per stored byte. Throws DataError.
ImageHeader read_image_header(std::span<const std::byte> bytes, const std::string& name,
                              const Limits& limits = {});
ImageHeader read_image_header(const std::filesystem::path& path, const Limits& limits = {});

struct ImageReadOptions {
  bool keep_alpha = false;  ///< a fourth channel (of grey: RGB and alpha), linear as stored
  bool linear = true;       ///< false: samples / 255 (65535) as stored, for normal maps and mattes
};

/// The image in linear light: 1 channel (grey) or 3 (RGB), or 4 with `keep_alpha`; 16-bit samples
/// keep their precision. Samples are taken as sRGB; colour profiles are ignored.
/// A file that is damaged anywhere is refused: a JPEG that ends early or makes libjpeg warn, a PNG
/// with a wrong checksum. Throws DataError.
Image read_image(std::span<const std::byte> bytes, const std::string& name,
                 const ImageReadOptions& options = {}, const Limits& limits = {});
Image read_image(const std::filesystem::path& path, const ImageReadOptions& options = {},
                 const Limits& limits = {});

/// The image as sRGB bytes, 1 or 3 channels (4 with alpha, if `keep_alpha`); 16-bit samples are
/// rounded. Throws DataError.
ByteImage read_byte_image(std::span<const std::byte> bytes, const std::string& name,
                          bool keep_alpha = false, const Limits& limits = {});
ByteImage read_byte_image(const std::filesystem::path& path, bool keep_alpha = false,
                          const Limits& limits = {});

/// A label map in a PNG, untouched: the index where there is a palette, else the grey sample (of 1
/// to 16 bits). Throws DataError for colours, other formats, and labels above 255.
ByteImage read_labels(std::span<const std::byte> bytes, const std::string& name,
                      const Limits& limits = {});
ByteImage read_labels(const std::filesystem::path& path, const Limits& limits = {});

struct ImageWriteOptions {
  int quality = 95;   ///< of JPEG, WebP and AVIF, 1..100; lower for smaller files
  int bit_depth = 8;  ///< 16: PNG and TIFF of an Image keep 16 bits a sample
};

/// Encodes linear light (1, 3 or 4 channels) as sRGB. Throws LogicError for another number of
/// channels, an empty image, NaN, or options out of range.
std::string image_bytes(const Image& image, ImageFormat format,
                        const ImageWriteOptions& options = {});
/// Encodes bytes as they are.
std::string image_bytes(const ByteImage& image, ImageFormat format,
                        const ImageWriteOptions& options = {});
/// A PNG whose palette index is the label, with a fixed colour for each label: a viewer shows the
/// regions, `read_labels` gives the labels back. One channel.
std::string label_bytes(const ByteImage& labels);

/// The format that a name asks to be written in, by its extension in any case; none for another.
std::optional<ImageFormat> image_format_of_name(const std::filesystem::path& path);

/// Writes by extension (.png .jpg .jpeg .tif .tiff .webp .bmp .avif), replacing the file as a
/// whole. Throws LogicError for another extension, DataError for more pixels than are read again,
/// EnvironmentError if it cannot be written, else as `image_bytes`.
void write_image(const std::filesystem::path& path, const Image& image,
                 const ImageWriteOptions& options = {});
void write_image(const std::filesystem::path& path, const ByteImage& image,
                 const ImageWriteOptions& options = {});
void write_labels(const std::filesystem::path& path, const ByteImage& labels);

}  // namespace atelier

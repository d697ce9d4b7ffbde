#include <algorithm>
#include <array>
#include <climits>
#include <cstring>
#include <utility>

#include "core/error.h"
#include "core/io/byte_reader.h"
#include "core/io/file_bytes.h"
#include "core/io/image_codec.h"

namespace atelier {
namespace {

bool begins_with(std::span<const std::byte> bytes, std::string_view magic, std::size_t at = 0) {
  return bytes.size() >= at + magic.size() &&
         std::memcmp(bytes.data() + at, magic.data(), magic.size()) == 0;
}

ImageFormat format_of(std::span<const std::byte> bytes, const std::string& name) {
  using std::string_view_literals::operator""sv;
  if (begins_with(bytes, "\x89PNG\r\n\x1a\n")) {
    return ImageFormat::Png;
  }
  if (begins_with(bytes, "\xFF\xD8\xFF")) {
    return ImageFormat::Jpeg;
  }
  if (begins_with(bytes, "II*\0"sv) || begins_with(bytes, "MM\0*"sv)) {
    return ImageFormat::Tiff;
  }
  if (begins_with(bytes, "RIFF") && begins_with(bytes, "WEBP", 8)) {
    return ImageFormat::WebP;
  }
  if (begins_with(bytes, "BM")) {
    return ImageFormat::Bmp;
  }
  if (begins_with(bytes, "ftypavif", 4) || begins_with(bytes, "ftypmif1", 4) ||
      begins_with(bytes, "ftypavis", 4)) {
    return ImageFormat::Avif;
  }
  throw DataError(name, "", "no known image format", "PNG, JPEG, TIFF, WebP, BMP or AVIF");
}

void check_size(const ImageHeader& header, std::size_t file_bytes, const std::string& name,
                const Limits& limits) {
  const std::int64_t width = header.width;
  const std::int64_t height = header.height;
  const std::string size = std::to_string(width) + " x " + std::to_string(height) + " pixels";
  if (width < 1 || height < 1) {
    throw DataError(name, "header", size, "at least 1 x 1");
  }
  if (width > limits.image_side || height > limits.image_side) {
    throw DataError(name, "header", size,
                    "at most " + std::to_string(limits.image_side) + " a side");
  }
  if (width * height > limits.image_pixels) {
    throw DataError(name, "header", size,
                    "at most " + std::to_string(limits.image_pixels) + " pixels");
  }
  const std::int64_t decoded =
      width * height * std::max(header.channels, 3) * (header.bit_depth > 8 ? 2 : 1);
  if (decoded > limits.inflate_free_bytes &&
      decoded / limits.inflate_ratio > static_cast<std::int64_t>(file_bytes)) {
    throw DataError(
        name, "header", size + " in " + std::to_string(file_bytes) + " bytes",
        "at most " + std::to_string(limits.inflate_ratio) + " decoded bytes for each stored one");
  }
}

}  // namespace

const char* format_name(ImageFormat format) {
  switch (format) {
    case ImageFormat::Png:
      return "PNG";
    case ImageFormat::Jpeg:
      return "JPEG";
    case ImageFormat::Tiff:
      return "TIFF";
    case ImageFormat::WebP:
      return "WebP";
    case ImageFormat::Bmp:
      return "BMP";
    case ImageFormat::Avif:
      return "AVIF";
  }
  return "";
}

ImageHeader read_image_header(std::span<const std::byte> bytes, const std::string& name,
                              const Limits& limits) {
  if (std::cmp_greater(bytes.size(), limits.image_file_bytes)) {
    throw DataError(name, "", std::to_string(bytes.size()) + " bytes",
                    "at most " + std::to_string(limits.image_file_bytes));
  }
  ImageHeader header;
  switch (format_of(bytes, name)) {
    case ImageFormat::Png:
      header = read_png_header(bytes, name);
      break;
    case ImageFormat::Jpeg:
      header = read_jpeg_header(bytes, name);
      break;
    case ImageFormat::Tiff:
      header = read_tiff_header(bytes, name, limits);
      break;
    case ImageFormat::WebP:
      header = read_webp_header(bytes, name);
      break;
    case ImageFormat::Bmp:
      header = read_bmp_header(bytes, name);
      break;
    case ImageFormat::Avif:
      header = read_avif_header(bytes, name, limits);
      break;
  }
  check_size(header, bytes.size(), name, limits);
  return header;
}

ImageHeader read_image_header(const std::filesystem::path& path, const Limits& limits) {
  return read_image_header(read_file_bytes(path, limits.image_file_bytes), path.string(), limits);
}

ImageHeader read_png_header(std::span<const std::byte> bytes, const std::string& name) {
  ByteReader reader(bytes, name);
  reader.skip(8, "PNG signature");
  if (reader.big<std::uint32_t>("length of IHDR") != 13 || reader.text(4, "IHDR") != "IHDR") {
    reader.fail("another chunk", "IHDR of 13 bytes first");
  }
  const auto width = reader.big<std::uint32_t>("width");
  const auto height = reader.big<std::uint32_t>("height");
  const int depth = reader.big<std::uint8_t>("bit depth");
  const int color = reader.big<std::uint8_t>("color type");
  if (width > 0x7FFFFFFFu || height > 0x7FFFFFFFu) {
    reader.fail("a side of 2^31 pixels or more", "less");
  }
  ImageHeader header{.format = ImageFormat::Png,
                     .width = static_cast<int>(width),
                     .height = static_cast<int>(height),
                     .bit_depth = depth,
                     .palette = color == 3};
  const bool low_depth = depth == 1 || depth == 2 || depth == 4;
  if (!(depth == 8 || (depth == 16 && color != 3) || (low_depth && (color == 0 || color == 3)))) {
    reader.fail("bit depth " + std::to_string(depth) + " with color type " + std::to_string(color),
                "a combination that PNG allows");
  }
  switch (color) {
    case 0:
      header.channels = 1;
      break;
    case 2:
    case 3:
      header.channels = 3;
      break;
    case 4:
      header.channels = 2;
      break;
    case 6:
      header.channels = 4;
      break;
    default:
      reader.fail("color type " + std::to_string(color), "0, 2, 3, 4 or 6");
  }
  reader.skip(7, "IHDR");
  // Every chunk must fit: libpng takes memory for some before it reads them.
  bool before_pixels = true;
  while (reader.remaining() >= 8) {
    const auto length = reader.big<std::uint32_t>("chunk length");
    const std::string_view type = reader.text(4, "chunk type");
    const std::span<const std::byte> data = reader.take(length, "chunk");
    reader.take(4, "checksum");
    before_pixels = before_pixels && type != "IDAT";
    if (type == "IEND") {
      break;
    }
    if (type == "eXIf") {
      header.orientation = exif_orientation(data);
    } else if (type == "tRNS" && before_pixels && (header.channels == 1 || header.channels == 3)) {
      ++header.channels;
    }
  }
  return header;
}

ImageHeader read_jpeg_header(std::span<const std::byte> bytes, const std::string& name) {
  ByteReader reader(bytes, name);
  reader.skip(2, "start of image");
  ImageHeader header{.format = ImageFormat::Jpeg};
  while (true) {
    int marker = reader.big<std::uint8_t>("marker");
    if (marker != 0xFF) {
      reader.fail("a byte between segments", "a marker");
    }
    while (marker == 0xFF) {
      marker = reader.big<std::uint8_t>("marker");
    }
    if (marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7)) {
      continue;  // stands alone
    }
    if (marker == 0xD8 || marker == 0xD9) {
      reader.fail("the image ends or begins again", "a frame");
    }
    const auto length = reader.big<std::uint16_t>("segment length");
    if (length < 2) {
      reader.fail("segment length " + std::to_string(length), "2 or more");
    }
    const std::span<const std::byte> segment = reader.take(length - 2u, "segment");
    const bool frame =
        marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
    if (frame && header.channels != 0) {
      reader.fail("a second frame", "one");
    }
    if (frame) {
      if (marker > 0xC2) {
        reader.fail("lossless, hierarchical or arithmetic coding", "baseline or progressive");
      }
      ByteReader sof(segment, name);
      header.bit_depth = sof.big<std::uint8_t>("sample precision");
      header.height = sof.big<std::uint16_t>("height");
      header.width = sof.big<std::uint16_t>("width");
      header.channels = sof.big<std::uint8_t>("components");
      if (header.bit_depth != 8) {
        reader.fail(std::to_string(header.bit_depth) + " bits a sample", "8");
      }
      if (header.channels != 1 && header.channels != 3) {
        reader.fail(std::to_string(header.channels) + " components (CMYK?)",
                    "1 (grey) or 3 (colour)");
      }
    } else if (marker == 0xE1 && begins_with(segment, std::string_view("Exif\0\0", 6))) {
      header.orientation = exif_orientation(segment.subspan(6));
    } else if (marker == 0xDA) {
      if (header.channels == 0) {
        reader.fail("a scan before the frame", "a frame");
      }
      return header;
    }
  }
}

ImageHeader read_webp_header(std::span<const std::byte> bytes, const std::string& name) {
  ByteReader reader(bytes, name);
  reader.skip(4, "RIFF");
  const auto size = reader.little<std::uint32_t>("size");
  if (size > reader.remaining()) {
    reader.fail(std::to_string(reader.remaining()) + " bytes", std::to_string(size));
  }
  reader.skip(4, "WEBP");
  ImageHeader header{.format = ImageFormat::WebP, .channels = 3, .bit_depth = 8};
  bool extended = false;
  while (reader.remaining() >= 8) {
    const std::string_view type = reader.text(4, "chunk type");
    const auto length = reader.little<std::uint32_t>("chunk length");
    const std::span<const std::byte> chunk = reader.take(length, "chunk");
    ByteReader data(chunk, name);
    if (type == "VP8X") {
      const int flags = data.little<std::uint8_t>("flags");
      if ((flags & 2) != 0) {
        reader.fail("an animation", "one image");
      }
      data.skip(3, "reserved");
      const auto side = [&data](const char* what) {
        const int low = data.little<std::uint16_t>(what);
        return 1 + low + (data.little<std::uint8_t>(what) << 16);
      };
      header.width = side("width");
      header.height = side("height");
      header.channels = (flags & 0x10) != 0 ? 4 : 3;
      extended = true;
    } else if (type == "VP8 " && !extended) {
      data.skip(6, "frame tag");
      header.width = data.little<std::uint16_t>("width") & 0x3FFF;
      header.height = data.little<std::uint16_t>("height") & 0x3FFF;
      return header;
    } else if (type == "VP8L" && !extended) {
      data.skip(1, "signature");
      const auto packed = data.little<std::uint32_t>("size");
      header.width = static_cast<int>(packed & 0x3FFF) + 1;
      header.height = static_cast<int>((packed >> 14) & 0x3FFF) + 1;
      header.channels = ((packed >> 28) & 1) != 0 ? 4 : 3;
      return header;
    } else if (type == "EXIF") {
      const bool prefixed = begins_with(chunk, std::string_view("Exif\0\0", 6));
      header.orientation = exif_orientation(prefixed ? chunk.subspan(6) : chunk);
    }
    if (length % 2 != 0 && reader.remaining() > 0) {
      reader.skip(1, "padding");
    }
  }
  if (!extended) {
    reader.fail("no image", "a chunk VP8, VP8L or VP8X");
  }
  return header;
}

ImageHeader read_bmp_header(std::span<const std::byte> bytes, const std::string& name) {
  ByteReader reader(bytes, name);
  reader.skip(10, "file header");
  const auto pixels_at = reader.little<std::uint32_t>("offset of the pixels");
  const auto header_size = reader.little<std::uint32_t>("header size");
  if (header_size < 40 || header_size > 124) {
    reader.fail("a header of " + std::to_string(header_size) + " bytes", "40 to 124");
  }
  const auto width = reader.little<std::int32_t>("width");
  const auto height = reader.little<std::int32_t>("height");
  reader.skip(2, "planes");
  const int bits = reader.little<std::uint16_t>("bits a pixel");
  const auto compression = reader.little<std::uint32_t>("compression");
  constexpr std::array<int, 6> kBits = {1, 4, 8, 16, 24, 32};
  if (std::find(kBits.begin(), kBits.end(), bits) == kBits.end() || compression > 3) {
    reader.fail(std::to_string(bits) + " bits a pixel, compression " + std::to_string(compression),
                "1, 4, 8, 16, 24 or 32 bits; no compression, RLE or bit fields");
  }
  if (width < 1 || height == 0 || height == INT_MIN) {
    reader.fail(std::to_string(width) + " x " + std::to_string(height) + " pixels",
                "at least 1 x 1");
  }
  ImageHeader header{.format = ImageFormat::Bmp,
                     .width = width,
                     .height = height < 0 ? -height : height,
                     .channels = 3,
                     .bit_depth = bits < 8 ? bits : 8,
                     .palette = bits <= 8};
  if (compression == 0 || compression == 3) {
    const std::uint64_t stride = (static_cast<std::uint64_t>(width) * bits + 31) / 32 * 4;
    reader.seek(pixels_at, "pixels");
    reader.paid(static_cast<std::uint64_t>(header.height), stride, "rows of pixels");
  }
  return header;
}

}  // namespace atelier

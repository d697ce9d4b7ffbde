#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_codec.h"
#include "core/io/image_file.h"
#include "core/io/srgb.h"

namespace atelier {
namespace {

Samples decode(std::span<const std::byte> bytes, const std::string& name, const ImageHeader& header,
               const Limits& limits) {
  switch (header.format) {
    case ImageFormat::Png:
      return decode_png(bytes, name, header, false);
    case ImageFormat::Jpeg:
      return decode_jpeg(bytes, name, header);
    case ImageFormat::Avif:
      return decode_avif(bytes, name, header, limits);
    case ImageFormat::Tiff:
    case ImageFormat::WebP:
    case ImageFormat::Bmp:
      return decode_opencv(bytes, name, header);
  }
  return {};
}

bool has_alpha(int channels) {
  return channels == 2 || channels == 4;
}

/// Channels as asked: 1 or 3, and with `keep_alpha` 4 where the file has alpha. `convert(sample,
/// is_alpha)` makes the samples of the result.
template <class To, class From, class Convert>
ImageOf<To> arranged(const ImageOf<From>& image, bool keep_alpha, const Convert& convert) {
  const bool alpha = has_alpha(image.channels);
  const int colors = alpha ? image.channels - 1 : image.channels;
  const bool to_alpha = keep_alpha && alpha;
  const int channels = to_alpha ? 4 : colors;
  ImageOf<To> result(image.width, image.height, channels);
  const std::size_t pixels = static_cast<std::size_t>(image.width) * image.height;
  for (std::size_t i = 0; i < pixels; ++i) {
    const From* from = image.data.data() + i * image.channels;
    To* to = result.data.data() + i * channels;
    for (int c = 0; c < std::min(channels, 3); ++c) {
      to[c] = convert(from[std::min(c, colors - 1)], false);
    }
    if (to_alpha) {
      to[3] = convert(from[image.channels - 1], true);
    }
  }
  return result;
}

template <class From>
Image floats(const ImageOf<From>& image, const ImageReadOptions& options) {
  constexpr std::size_t kValues = std::size_t{1} << (8 * sizeof(From));
  std::vector<float> stored(kValues);
  std::vector<float> color(kValues);
  for (std::size_t i = 0; i < kValues; ++i) {
    stored[i] = static_cast<float>(static_cast<double>(i) / static_cast<double>(kValues - 1));
    color[i] = options.linear ? linear_from_srgb(stored[i]) : stored[i];
  }
  return arranged<float>(image, options.keep_alpha, [&](From sample, bool is_alpha) {
    return is_alpha ? stored[sample] : color[sample];
  });
}

}  // namespace

Image read_image(std::span<const std::byte> bytes, const std::string& name,
                 const ImageReadOptions& options, const Limits& limits) {
  const ImageHeader header = read_image_header(bytes, name, limits);
  const Samples samples = decode(bytes, name, header, limits);
  return std::visit([&](const auto& image) { return floats(image, options); }, samples);
}

Image read_image(const std::filesystem::path& path, const ImageReadOptions& options,
                 const Limits& limits) {
  return read_image(read_file_bytes(path, limits.image_file_bytes), path.string(), options, limits);
}

ByteImage read_byte_image(std::span<const std::byte> bytes, const std::string& name,
                          bool keep_alpha, const Limits& limits) {
  const ImageHeader header = read_image_header(bytes, name, limits);
  const Samples samples = decode(bytes, name, header, limits);
  if (const auto* image = std::get_if<ByteImage>(&samples)) {
    return arranged<std::uint8_t>(*image, keep_alpha,
                                  [](std::uint8_t sample, bool) { return sample; });
  }
  return arranged<std::uint8_t>(
      std::get<ImageOf<std::uint16_t>>(samples), keep_alpha,
      [](std::uint16_t sample, bool) { return static_cast<std::uint8_t>((sample + 128) / 257); });
}

ByteImage read_byte_image(const std::filesystem::path& path, bool keep_alpha,
                          const Limits& limits) {
  return read_byte_image(read_file_bytes(path, limits.image_file_bytes), path.string(), keep_alpha,
                         limits);
}

ByteImage read_labels(std::span<const std::byte> bytes, const std::string& name,
                      const Limits& limits) {
  const ImageHeader header = read_image_header(bytes, name, limits);
  if (header.format != ImageFormat::Png) {
    throw DataError(name, "", std::string("labels in ") + format_name(header.format),
                    "PNG, which keeps every value");
  }
  if (!header.palette && header.channels != 1) {
    throw DataError(name, "", "an image with colours", "labels: a palette or one channel");
  }
  const Samples samples = decode_png(bytes, name, header, true);
  if (const auto* image = std::get_if<ByteImage>(&samples)) {
    return *image;
  }
  const auto& wide = std::get<ImageOf<std::uint16_t>>(samples);
  ByteImage labels(wide.width, wide.height, 1);
  for (std::size_t i = 0; i < wide.data.size(); ++i) {
    if (wide.data[i] > 255) {
      throw DataError(name,
                      "pixel " + std::to_string(i % static_cast<std::size_t>(wide.width)) + ", " +
                          std::to_string(i / static_cast<std::size_t>(wide.width)),
                      "label " + std::to_string(wide.data[i]), "0 to 255");
    }
    labels.data[i] = static_cast<std::uint8_t>(wide.data[i]);
  }
  return labels;
}

ByteImage read_labels(const std::filesystem::path& path, const Limits& limits) {
  return read_labels(read_file_bytes(path, limits.image_file_bytes), path.string(), limits);
}

}  // namespace atelier

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/image_codec.h"
#include "core/io/image_file.h"
#include "core/io/lower_extension.h"
#include "core/io/srgb.h"
#include "core/limits.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

template <class T>
void check_image(const ImageOf<T>& image, const ImageWriteOptions& options) {
  ATELIER_CHECK(image.width > 0 && image.height > 0, "an image without pixels");
  ATELIER_CHECK(image.channels == 1 || image.channels == 3 || image.channels == 4,
                "an image needs 1, 3 or 4 channels");
  ATELIER_CHECK(
      image.data.size() == static_cast<std::size_t>(image.width) * image.height * image.channels,
      "an image whose data are not its size");
  ATELIER_CHECK(options.quality >= 1 && options.quality <= 100, "quality must be 1 to 100");
  ATELIER_CHECK(options.bit_depth == 8 || options.bit_depth == 16, "bit_depth must be 8 or 16");
}

/// sRGB samples of linear light; the fourth channel stays linear.
template <class T>
ImageOf<T> stored(const Image& image) {
  constexpr float kMost = static_cast<float>((1 << (8 * sizeof(T))) - 1);
  ImageOf<T> result(image.width, image.height, image.channels);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    const bool alpha = image.channels == 4 && i % 4 == 3;
    const float value =
        alpha ? std::clamp(image.data[i], 0.0F, 1.0F) : srgb_from_linear(image.data[i]);
    result.data[i] = saturating_cast<T>(std::round(kMost * value));
  }
  return result;
}

/// JPEG and AVIF have 8 bits.
std::string encode(const Samples& image, ImageFormat format, int quality) {
  switch (format) {
    case ImageFormat::Png:
      return encode_png(image);
    case ImageFormat::Jpeg:
      return encode_jpeg(std::get<ByteImage>(image), quality);
    case ImageFormat::Avif:
      return encode_avif(std::get<ByteImage>(image), quality);
    case ImageFormat::Tiff:
    case ImageFormat::WebP:
    case ImageFormat::Bmp:
      return encode_opencv(image, format, quality);
  }
  return {};
}

ImageFormat format_of(const std::filesystem::path& path) {
  const std::optional<ImageFormat> format = image_format_of_name(path);
  ATELIER_CHECK(format.has_value(), "no image format for '" + path.string() + "'");
  return *format;
}

}  // namespace

std::optional<ImageFormat> image_format_of_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  struct Extension {
    const char* name;
    ImageFormat format;
  };
  constexpr Extension kExtensions[] = {{".png", ImageFormat::Png},   {".jpg", ImageFormat::Jpeg},
                                       {".jpeg", ImageFormat::Jpeg}, {".tif", ImageFormat::Tiff},
                                       {".tiff", ImageFormat::Tiff}, {".webp", ImageFormat::WebP},
                                       {".bmp", ImageFormat::Bmp},   {".avif", ImageFormat::Avif}};
  for (const Extension& known : kExtensions) {
    if (extension == known.name) {
      return known.format;
    }
  }
  return std::nullopt;
}

std::string image_bytes(const ByteImage& image, ImageFormat format,
                        const ImageWriteOptions& options) {
  check_image(image, options);
  ATELIER_CHECK((format != ImageFormat::Jpeg && format != ImageFormat::Bmp) || image.channels != 4,
                "JPEG and BMP have no alpha");
  return encode(image, format, options.quality);
}

std::string image_bytes(const Image& image, ImageFormat format, const ImageWriteOptions& options) {
  check_image(image, options);
  ATELIER_CHECK(std::none_of(image.data.begin(), image.data.end(),
                             [](float value) { return std::isnan(value); }),
                "an image with NaN");
  if (options.bit_depth == 16) {
    ATELIER_CHECK(format == ImageFormat::Png || format == ImageFormat::Tiff,
                  "only PNG and TIFF keep 16 bits");
    return encode(stored<std::uint16_t>(image), format, options.quality);
  }
  return image_bytes(stored<std::uint8_t>(image), format, options);
}

std::string label_bytes(const ByteImage& labels) {
  check_image(labels, {});
  ATELIER_CHECK(labels.channels == 1, "labels have one channel");
  return encode_palette_png(labels);
}

namespace {

/// Only images that can be read again are written.
void require_readable_size(const std::filesystem::path& path, std::int64_t width,
                           std::int64_t height) {
  const Limits limits;
  if (width > limits.image_side || height > limits.image_side ||
      width * height > limits.image_pixels) {
    throw DataError(path.string(), "",
                    std::to_string(width) + " x " + std::to_string(height) + " pixels",
                    "sides of at most " + std::to_string(limits.image_side) + " and at most " +
                        std::to_string(limits.image_pixels) + " pixels");
  }
}

}  // namespace

void write_image(const std::filesystem::path& path, const Image& image,
                 const ImageWriteOptions& options) {
  require_readable_size(path, image.width, image.height);
  write_file_atomically(path, image_bytes(image, format_of(path), options));
}

void write_image(const std::filesystem::path& path, const ByteImage& image,
                 const ImageWriteOptions& options) {
  require_readable_size(path, image.width, image.height);
  write_file_atomically(path, image_bytes(image, format_of(path), options));
}

void write_labels(const std::filesystem::path& path, const ByteImage& labels) {
  ATELIER_CHECK(format_of(path) == ImageFormat::Png, "labels are written as .png");
  write_file_atomically(path, label_bytes(labels));
}

}  // namespace atelier

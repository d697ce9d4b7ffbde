#include <algorithm>
#include <memory>

#include <avif/avif.h>

#include "core/error.h"
#include "core/io/image_codec.h"

namespace atelier {
namespace {

using DecoderPointer = std::unique_ptr<avifDecoder, decltype(&avifDecoderDestroy)>;

[[noreturn]] void fail(const std::string& name, avifResult result) {
  if (result == AVIF_RESULT_OUT_OF_MEMORY) {
    throw EnvironmentError(name, "libavif: no memory");
  }
  throw DataError(name, "", std::string("libavif: ") + avifResultToString(result),
                  "an undamaged AVIF");
}

/// A decoder that has read the boxes, but no pixels. `bytes` must outlive it.
DecoderPointer parsed(std::span<const std::byte> bytes, const std::string& name,
                      const Limits& limits) {
  DecoderPointer decoder(avifDecoderCreate(), avifDecoderDestroy);
  if (decoder == nullptr) {
    throw EnvironmentError(name, "libavif: no memory");
  }
  if (avifCodecName(AVIF_CODEC_CHOICE_DAV1D, AVIF_CODEC_FLAG_CAN_DECODE) != nullptr) {
    decoder->codecChoice = AVIF_CODEC_CHOICE_DAV1D;  // keeps the ceiling on pixels
  }
  decoder->requestedSource = AVIF_DECODER_SOURCE_PRIMARY_ITEM;
  decoder->maxThreads = 1;
  decoder->ignoreExif = AVIF_TRUE;
  decoder->ignoreXMP = AVIF_TRUE;
  decoder->strictFlags = AVIF_STRICT_ENABLED;
  decoder->imageCountLimit = 1;
  decoder->imageDimensionLimit = static_cast<std::uint32_t>(limits.image_side);
  decoder->imageSizeLimit = static_cast<std::uint32_t>(
      std::min<std::int64_t>(limits.image_pixels, AVIF_DEFAULT_IMAGE_SIZE_LIMIT));
  avifResult result = avifDecoderSetIOMemory(
      decoder.get(), reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  if (result == AVIF_RESULT_OK) {
    result = avifDecoderParse(decoder.get());
  }
  if (result != AVIF_RESULT_OK) {
    fail(name, result);
  }
  return decoder;
}

/// EXIF's number for AVIF's turns (90 degrees each, counter-clockwise) and mirrors.
int orientation_of(const avifImage& image) {
  const int turns = (image.transformFlags & AVIF_TRANSFORM_IROT) != 0 ? image.irot.angle & 3 : 0;
  if ((image.transformFlags & AVIF_TRANSFORM_IMIR) == 0) {
    constexpr int kTurned[] = {1, 8, 3, 6};
    return kTurned[turns];
  }
  constexpr int kMirrored[2][4] = {{4, 5, 2, 7}, {2, 7, 4, 5}};
  return kMirrored[image.imir.mode & 1][turns];
}

}  // namespace

ImageHeader read_avif_header(std::span<const std::byte> bytes, const std::string& name,
                             const Limits& limits) {
  const DecoderPointer decoder = parsed(bytes, name, limits);
  const avifImage& image = *decoder->image;
  const bool grey = image.yuvFormat == AVIF_PIXEL_FORMAT_YUV400;
  return {.format = ImageFormat::Avif,
          .width = static_cast<int>(image.width),
          .height = static_cast<int>(image.height),
          .channels = (grey ? 1 : 3) + (decoder->alphaPresent != 0 ? 1 : 0),
          .bit_depth = static_cast<int>(image.depth),
          .orientation = orientation_of(image)};
}

Samples decode_avif(std::span<const std::byte> bytes, const std::string& name,
                    const ImageHeader& header, const Limits& limits) {
  const DecoderPointer decoder = parsed(bytes, name, limits);
  // The image inside may say another size than the boxes: no more pixels than were promised.
  decoder->imageSizeLimit =
      static_cast<std::uint32_t>(header.width) * static_cast<std::uint32_t>(header.height);
  avifResult result = avifDecoderNextImage(decoder.get());
  if (result != AVIF_RESULT_OK) {
    fail(name, result);
  }
  if (decoder->image->width != static_cast<std::uint32_t>(header.width) ||
      decoder->image->height != static_cast<std::uint32_t>(header.height)) {
    throw DataError(name, "", "an image of another size than the header's", "the same size");
  }
  const bool alpha = decoder->alphaPresent != 0;
  const int channels = alpha ? 4 : 3;
  avifRGBImage rgb;
  avifRGBImageSetDefaults(&rgb, decoder->image);
  rgb.format = alpha ? AVIF_RGB_FORMAT_RGBA : AVIF_RGB_FORMAT_RGB;
  const auto convert = [&](auto image) {
    using Sample = typename decltype(image.data)::value_type;
    rgb.depth = 8 * sizeof(Sample);
    rgb.rowBytes = static_cast<std::uint32_t>(image.width * channels * sizeof(Sample));
    rgb.pixels = reinterpret_cast<std::uint8_t*>(image.data.data());
    result = avifImageYUVToRGB(decoder->image, &rgb);
    if (result != AVIF_RESULT_OK) {
      fail(name, result);
    }
    return Samples(std::move(image));
  };
  if (header.bit_depth > 8) {
    return convert(ImageOf<std::uint16_t>(header.width, header.height, channels));
  }
  return convert(ByteImage(header.width, header.height, channels));
}

std::string encode_avif(const ByteImage& image, int quality) {
  const auto check = [](avifResult result) {
    if (result != AVIF_RESULT_OK) {
      throw EnvironmentError("libavif", avifResultToString(result));
    }
  };
  const std::unique_ptr<avifImage, decltype(&avifImageDestroy)> avif(
      avifImageCreate(image.width, image.height, 8,
                      image.channels == 1 ? AVIF_PIXEL_FORMAT_YUV400 : AVIF_PIXEL_FORMAT_YUV444),
      avifImageDestroy);
  const std::unique_ptr<avifEncoder, decltype(&avifEncoderDestroy)> encoder(avifEncoderCreate(),
                                                                            avifEncoderDestroy);
  if (avif == nullptr || encoder == nullptr) {
    throw EnvironmentError("libavif", "no memory");
  }
  avif->colorPrimaries = AVIF_COLOR_PRIMARIES_BT709;
  avif->transferCharacteristics = AVIF_TRANSFER_CHARACTERISTICS_SRGB;
  ByteImage expanded;  // libavif reads three channels
  if (image.channels == 1) {
    expanded = ByteImage(image.width, image.height, 3);
    for (std::size_t i = 0; i < image.data.size(); ++i) {
      std::fill_n(expanded.data.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, image.data[i]);
    }
  }
  const ByteImage& source = image.channels == 1 ? expanded : image;
  avifRGBImage rgb;
  avifRGBImageSetDefaults(&rgb, avif.get());
  rgb.depth = 8;
  rgb.format = source.channels == 4 ? AVIF_RGB_FORMAT_RGBA : AVIF_RGB_FORMAT_RGB;
  rgb.rowBytes = static_cast<std::uint32_t>(source.width * source.channels);
  // libavif takes pixels it only reads as not const.
  rgb.pixels = const_cast<std::uint8_t*>(source.data.data());
  check(avifImageRGBToYUV(avif.get(), &rgb));
  const int quantizer = std::clamp((100 - quality) * 63 / 100, 0, 63);
  encoder->maxThreads = 1;
  encoder->speed = 8;
  encoder->minQuantizer = quantizer;
  encoder->maxQuantizer = quantizer;
  encoder->minQuantizerAlpha = 0;
  encoder->maxQuantizerAlpha = 0;
  avifRWData output = AVIF_DATA_EMPTY;
  const avifResult result = avifEncoderWrite(encoder.get(), avif.get(), &output);
  const std::string bytes(reinterpret_cast<const char*>(output.data), output.size);
  avifRWDataFree(&output);
  check(result);
  return bytes;
}

}  // namespace atelier

#include <array>
#include <bit>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <vector>

#include <png.h>

#include "core/error.h"
#include "core/io/image_codec.h"
#include "core/saturating_cast.h"

namespace atelier {
namespace {

/// The bytes that remain and what libpng complained of. Plain data: longjmp runs no destructors.
struct PngState {
  const unsigned char* next = nullptr;
  std::size_t left = 0;
  std::string* output = nullptr;
  char complaint[256] = {};
};

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  PngState& state = *static_cast<PngState*>(png_get_error_ptr(png));
  std::snprintf(state.complaint, sizeof state.complaint, "%s", message);
  png_longjmp(png, 1);
}

/// Warnings of libpng are about colour profiles and times; damage is an error.
void on_warning(png_structp, png_const_charp) {}

void read_bytes(png_structp png, png_bytep target, std::size_t count) {
  PngState& state = *static_cast<PngState*>(png_get_io_ptr(png));
  if (count > state.left) {
    png_error(png, "the file ends early");
  }
  std::memcpy(target, state.next, count);
  state.next += count;
  state.left -= count;
}

/// True if everything up to IEND was decoded into `rows`. No objects with destructors in here.
bool decode(PngState& state, png_bytep* rows, std::size_t row_bytes, const ImageHeader& header,
            bool raw) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &state, on_error, on_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr) {
    png_destroy_read_struct(&png, nullptr, nullptr);
    std::snprintf(state.complaint, sizeof state.complaint, "no memory");
    return false;
  }
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_read_struct(&png, &info, nullptr);
    return false;
  }
  png_set_user_limits(png, static_cast<png_uint_32>(header.width),
                      static_cast<png_uint_32>(header.height));
  png_set_chunk_cache_max(png, 128);
  png_set_chunk_malloc_max(png, 8u << 20);
  png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  png_set_read_fn(png, &state, read_bytes);
  png_read_info(png, info);
  if (raw) {
    png_set_packing(png);
  } else {
    png_set_expand(png);  // palettes to RGB, grey to 8 bits, tRNS to alpha
  }
  if constexpr (std::endian::native == std::endian::little) {
    png_set_swap(png);
  }
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_rowbytes(png, info) != row_bytes) {
    png_error(png, "a size unlike the header's");
  }
  png_read_image(png, rows);
  png_read_end(png, info);
  png_destroy_read_struct(&png, &info, nullptr);
  return true;
}

template <class T>
ImageOf<T> decoded(std::span<const std::byte> bytes, const std::string& name,
                   const ImageHeader& header, bool raw) {
  ImageOf<T> image(header.width, header.height, raw ? 1 : header.channels);
  const std::size_t row_samples = static_cast<std::size_t>(image.width) * image.channels;
  std::vector<png_bytep> rows;
  rows.reserve(static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    rows.push_back(reinterpret_cast<png_bytep>(image.data.data() + row_samples * y));
  }
  PngState state;
  state.next = reinterpret_cast<const unsigned char*>(bytes.data());
  state.left = bytes.size();
  if (!decode(state, rows.data(), row_samples * sizeof(T), header, raw)) {
    throw DataError(name, "", std::string("libpng: ") + state.complaint, "an undamaged PNG");
  }
  return image;
}

void append_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  // A failed allocation must not unwind through C.
  PngState& state = *static_cast<PngState*>(png_get_io_ptr(png));
  bool full = false;
  try {
    state.output->append(reinterpret_cast<const char*>(bytes), count);
  } catch (const std::bad_alloc&) {
    full = true;
  }
  if (full) {
    png_error(png, "no memory");
  }
}

struct PngPicture {
  const png_byte* samples;
  int width, height, channels;
  int bit_depth;             ///< 8 or 16
  const png_color* palette;  ///< [256], or null: grey, RGB or RGBA
};

bool encode(PngState& state, const PngPicture& picture) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &state, on_error, on_warning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr) {
    png_destroy_write_struct(&png, nullptr);
    return false;
  }
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &state, append_bytes, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width),
               static_cast<png_uint_32>(picture.height), picture.bit_depth,
               picture.palette != nullptr ? PNG_COLOR_TYPE_PALETTE
               : picture.channels == 1    ? PNG_COLOR_TYPE_GRAY
               : picture.channels == 3    ? PNG_COLOR_TYPE_RGB
                                          : PNG_COLOR_TYPE_RGB_ALPHA,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (picture.palette != nullptr) {
    png_set_PLTE(png, info, picture.palette, 256);
  } else {
    // The fastest of those that do well on rendered and photographed pictures.
    constexpr int kFastest = 1;
    constexpr int kRunLengths = 3;  // Z_RLE
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(png, kFastest);
    png_set_compression_strategy(png, kRunLengths);
  }
  png_write_info(png, info);
  if constexpr (std::endian::native == std::endian::little) {
    png_set_swap(png);
  }
  const std::size_t row_bytes =
      static_cast<std::size_t>(picture.width) * picture.channels * (picture.bit_depth / 8);
  for (int y = 0; y < picture.height; ++y) {
    png_write_row(png, picture.samples + row_bytes * y);
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return true;
}

/// Label 0 is black; the others walk around the hues by the golden angle, in three brightnesses.
std::array<png_color, 256> label_colors() {
  std::array<png_color, 256> colors{};
  for (int label = 1; label < 256; ++label) {
    const double hue = std::fmod(label * 0.61803398875, 1.0) * 6;
    const double value = 255 - 60 * (label % 3);
    const auto channel = [&](double shift) {
      const double x = std::fmod(hue + shift, 6.0);
      const double weight = x < 1 ? x : x < 3 ? 1 : x < 4 ? 4 - x : 0;
      return saturating_cast<png_byte>(std::round(value * (0.2 + 0.8 * weight)));
    };
    colors[label] = {channel(2), channel(0), channel(4)};
  }
  return colors;
}

}  // namespace

Samples decode_png(std::span<const std::byte> bytes, const std::string& name,
                   const ImageHeader& header, bool raw) {
  if (header.bit_depth == 16) {
    return decoded<std::uint16_t>(bytes, name, header, raw);
  }
  return decoded<std::uint8_t>(bytes, name, header, raw);
}

std::string encode_png(const Samples& image) {
  std::string output;
  PngState state;
  state.output = &output;
  const bool whole = std::visit(
      [&](const auto& samples) {
        return encode(state, {reinterpret_cast<const png_byte*>(samples.data.data()), samples.width,
                              samples.height, samples.channels,
                              8 * static_cast<int>(sizeof(samples.data[0])), nullptr});
      },
      image);
  if (!whole) {
    throw EnvironmentError("libpng", state.complaint);
  }
  return output;
}

std::string encode_palette_png(const ByteImage& indices) {
  std::string output;
  PngState state;
  state.output = &output;
  const std::array<png_color, 256> colors = label_colors();
  if (!encode(state, {indices.data.data(), indices.width, indices.height, 1, 8, colors.data()})) {
    throw EnvironmentError("libpng", state.complaint);
  }
  return output;
}

}  // namespace atelier

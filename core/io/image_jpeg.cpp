#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include <jpeglib.h>

#include "core/error.h"
#include "core/io/image_codec.h"

namespace atelier {
namespace {

constexpr int kMaxScans = 128;  // a progressive file has about 10; each costs a pass over the image

/// libjpeg's state, what it complained of, and where to go then. Plain data: longjmp runs no
/// destructors.
struct Decoder {
  jpeg_decompress_struct jpeg;
  jpeg_error_mgr errors;
  jpeg_progress_mgr progress;
  std::jmp_buf stop;
  char complaint[JMSG_LENGTH_MAX];
};

[[noreturn]] void stop(j_common_ptr jpeg) {
  Decoder& decoder = *static_cast<Decoder*>(jpeg->client_data);
  jpeg->err->format_message(jpeg, decoder.complaint);
  std::longjmp(decoder.stop, 1);
}

/// A warning means that bytes were missing or senseless and pixels were made up.
void on_message(j_common_ptr jpeg, int level) {
  if (level < 0) {
    stop(jpeg);
  }
}

void on_progress(j_common_ptr jpeg) {
  Decoder& decoder = *static_cast<Decoder*>(jpeg->client_data);
  if (decoder.jpeg.input_scan_number > kMaxScans) {
    std::snprintf(decoder.complaint, sizeof decoder.complaint, "more than %d scans", kMaxScans);
    std::longjmp(decoder.stop, 1);
  }
}

/// True if all of `bytes` was decoded into `pixels`, rows of `row_bytes`. No objects with
/// destructors in here.
bool decode(Decoder& decoder, std::span<const std::byte> bytes, const ImageHeader& header,
            unsigned char* pixels, std::size_t row_bytes) {
  decoder.jpeg.err = jpeg_std_error(&decoder.errors);
  decoder.errors.error_exit = stop;
  decoder.errors.emit_message = on_message;
  decoder.jpeg.client_data = &decoder;
  if (setjmp(decoder.stop) != 0) {
    jpeg_destroy_decompress(&decoder.jpeg);
    return false;
  }
  jpeg_create_decompress(&decoder.jpeg);
  decoder.jpeg.client_data = &decoder;
  decoder.progress.progress_monitor = on_progress;
  decoder.jpeg.progress = &decoder.progress;
  jpeg_mem_src(&decoder.jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&decoder.jpeg, TRUE);
  decoder.jpeg.out_color_space = header.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&decoder.jpeg);
  if (decoder.jpeg.output_width != static_cast<unsigned>(header.width) ||
      decoder.jpeg.output_height != static_cast<unsigned>(header.height) ||
      decoder.jpeg.output_components != header.channels) {
    std::snprintf(decoder.complaint, sizeof decoder.complaint, "a size unlike the header's");
    jpeg_destroy_decompress(&decoder.jpeg);
    return false;
  }
  while (decoder.jpeg.output_scanline < decoder.jpeg.output_height) {
    JSAMPROW row = pixels + decoder.jpeg.output_scanline * row_bytes;
    jpeg_read_scanlines(&decoder.jpeg, &row, 1);
  }
  jpeg_finish_decompress(&decoder.jpeg);  // reads on to the end-of-image marker
  jpeg_destroy_decompress(&decoder.jpeg);
  return true;
}

/// As `Decoder`, and the bytes that libjpeg allocates.
struct Encoder {
  jpeg_compress_struct jpeg;
  jpeg_error_mgr errors;
  std::jmp_buf stop;
  char complaint[JMSG_LENGTH_MAX];
  unsigned char* bytes;
  unsigned long size;
};

[[noreturn]] void stop_encoder(j_common_ptr jpeg) {
  Encoder& encoder = *static_cast<Encoder*>(jpeg->client_data);
  jpeg->err->format_message(jpeg, encoder.complaint);
  std::longjmp(encoder.stop, 1);
}

/// No objects with destructors in here.
bool encode(Encoder& encoder, const ByteImage& image, int quality) {
  encoder.jpeg.err = jpeg_std_error(&encoder.errors);
  encoder.errors.error_exit = stop_encoder;
  encoder.jpeg.client_data = &encoder;
  if (setjmp(encoder.stop) != 0) {
    jpeg_destroy_compress(&encoder.jpeg);
    return false;
  }
  jpeg_create_compress(&encoder.jpeg);
  encoder.jpeg.client_data = &encoder;
  jpeg_mem_dest(&encoder.jpeg, &encoder.bytes, &encoder.size);
  encoder.jpeg.image_width = static_cast<JDIMENSION>(image.width);
  encoder.jpeg.image_height = static_cast<JDIMENSION>(image.height);
  encoder.jpeg.input_components = image.channels;
  encoder.jpeg.in_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&encoder.jpeg);
  jpeg_set_quality(&encoder.jpeg, quality, TRUE);
  jpeg_start_compress(&encoder.jpeg, TRUE);
  const std::size_t row_bytes = static_cast<std::size_t>(image.width) * image.channels;
  while (encoder.jpeg.next_scanline < encoder.jpeg.image_height) {
    // libjpeg only reads its input, but takes rows that are not const.
    JSAMPROW row =
        const_cast<unsigned char*>(image.data.data() + encoder.jpeg.next_scanline * row_bytes);
    jpeg_write_scanlines(&encoder.jpeg, &row, 1);
  }
  jpeg_finish_compress(&encoder.jpeg);
  jpeg_destroy_compress(&encoder.jpeg);
  return true;
}

}  // namespace

ByteImage decode_jpeg(std::span<const std::byte> bytes, const std::string& name,
                      const ImageHeader& header) {
  ByteImage image(header.width, header.height, header.channels);
  Decoder decoder{};
  if (!decode(decoder, bytes, header, image.data.data(),
              static_cast<std::size_t>(header.width) * header.channels)) {
    throw DataError(name, "", std::string("libjpeg: ") + decoder.complaint, "an undamaged JPEG");
  }
  return image;
}

std::string encode_jpeg(const ByteImage& image, int quality) {
  Encoder encoder{};
  const bool whole = encode(encoder, image, quality);
  const std::unique_ptr<unsigned char, decltype(&std::free)> bytes(encoder.bytes, &std::free);
  if (!whole) {
    throw EnvironmentError("libjpeg", encoder.complaint);
  }
  return {reinterpret_cast<const char*>(encoder.bytes), encoder.size};
}

}  // namespace atelier

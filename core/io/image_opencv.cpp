#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/io/image_codec.h"
#include "core/late_library.h"

namespace atelier {
namespace {

// Of core/io/late/pictures.cpp.
constexpr const char* kLibrary = "libatelier_pictures.so";
using DecodePicture = void(const cv::Mat& encoded, int flags, cv::Mat& picture);
using EncodePicture = bool(const char* extension, const cv::Mat& picture,
                           const std::vector<int>& parameters, std::vector<unsigned char>& encoded);

/// OpenCV keeps colours as B G R (A).
template <class T>
void swap_red_and_blue(ImageOf<T>& image) {
  if (image.channels >= 3) {
    for (std::size_t i = 0; i < image.data.size(); i += image.channels) {
      std::swap(image.data[i], image.data[i + 2]);
    }
  }
}

template <class T>
ImageOf<T> copied(const cv::Mat& matrix) {
  ImageOf<T> image(matrix.cols, matrix.rows, matrix.channels());
  const std::size_t row = static_cast<std::size_t>(image.width) * image.channels;
  for (int y = 0; y < image.height; ++y) {
    std::copy_n(matrix.ptr<T>(y), row, image.data.begin() + static_cast<std::ptrdiff_t>(row * y));
  }
  swap_red_and_blue(image);
  return image;
}

const char* extension_of(ImageFormat format) {
  switch (format) {
    case ImageFormat::Tiff:
      return ".tiff";
    case ImageFormat::WebP:
      return ".webp";
    case ImageFormat::Bmp:
      return ".bmp";
    case ImageFormat::Png:
    case ImageFormat::Jpeg:
    case ImageFormat::Avif:
      break;  // have encoders of their own
  }
  return "";
}

}  // namespace

Samples decode_opencv(std::span<const std::byte> bytes, const std::string& name,
                      const ImageHeader& header) {
  // OpenCV asks its DICOM codec before the right one: it looks at byte 128 alone, and its library
  // ends the program on a file that is none.
  constexpr std::size_t kDicomMark = 128;
  if (bytes.size() >= kDicomMark + 4 && std::memcmp(bytes.data() + kDicomMark, "DICM", 4) == 0) {
    throw DataError(name, "byte 128", "the mark of a DICOM file", "an image of one format");
  }
  static const auto decode_picture =
      late_function<DecodePicture>(kLibrary, "atelier_decode_picture");
  cv::Mat matrix;
  try {
    // imdecode only reads its input, but takes a matrix that is not const.
    const cv::Mat encoded(1, static_cast<int>(bytes.size()), CV_8U,
                          const_cast<std::byte*>(bytes.data()));
    // The fourth byte of a BMP pixel is seldom meant as alpha.
    const int channels =
        header.format == ImageFormat::Bmp ? cv::IMREAD_COLOR : cv::IMREAD_UNCHANGED;
    decode_picture(encoded, channels | cv::IMREAD_IGNORE_ORIENTATION, matrix);
  } catch (const cv::Exception& error) {
    throw DataError(name, "", "OpenCV: " + error.err,
                    "an undamaged " + std::string(format_name(header.format)));
  }
  if (matrix.empty()) {
    throw DataError(name, "", "OpenCV cannot decode it",
                    "an undamaged " + std::string(format_name(header.format)));
  }
  const std::string found = std::to_string(matrix.cols) + " x " + std::to_string(matrix.rows);
  if (matrix.cols != header.width || matrix.rows != header.height) {
    throw DataError(name, "", "an image of " + found + " pixels", "the size of the header");
  }
  if (matrix.depth() == CV_16U) {
    return copied<std::uint16_t>(matrix);
  }
  if (matrix.depth() != CV_8U) {
    throw DataError(name, "", "samples that are neither 8 nor 16 bits", "8 or 16 bits");
  }
  return copied<std::uint8_t>(matrix);
}

std::string encode_opencv(const Samples& image, ImageFormat format, int quality) {
  static const auto encode_picture =
      late_function<EncodePicture>(kLibrary, "atelier_encode_picture");
  std::vector<int> parameters;
  if (format == ImageFormat::WebP) {
    parameters = {cv::IMWRITE_WEBP_QUALITY, quality};
  }
  std::vector<unsigned char> encoded;
  const auto encode = [&](auto copy) {
    using Sample = typename decltype(copy.data)::value_type;
    swap_red_and_blue(copy);
    const cv::Mat matrix(copy.height, copy.width,
                         CV_MAKETYPE(cv::DataType<Sample>::depth, copy.channels), copy.data.data());
    try {
      return encode_picture(extension_of(format), matrix, parameters, encoded);
    } catch (const cv::Exception& error) {
      throw EnvironmentError("OpenCV", error.err);
    }
  };
  if (!std::visit(encode, image)) {
    throw EnvironmentError("OpenCV", std::string("cannot encode ") + format_name(format));
  }
  return {encoded.begin(), encoded.end()};
}

}  // namespace atelier

#include "core/io/image_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/io/file_bytes.h"
#include "tests/support/places.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::TemporaryDirectory;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::string corpus(const std::string& file) {
  return read_file_text(fixtures::source_directory() / "fuzz" / "corpus" / file, 1 << 20);
}

std::string image_file_refusal(const std::string& file, const Limits& limits = {}) {
  try {
    read_image(bytes_of(file), "test", {}, limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "was read";
}

/// Smooth, so that lossy formats keep it, and different in every channel.
ByteImage smooth(int width, int height, int channels) {
  ByteImage image(width, height, channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        const double wave = std::sin(0.05 * (x * (c + 1) + y * (3 - c)));
        image.at(x, y, c) = static_cast<std::uint8_t>(127.5 + 100 * wave);
      }
    }
  }
  return image;
}

int largest_difference(const ByteImage& a, const ByteImage& b) {
  int largest = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    largest = std::max(largest, std::abs(int{a.data[i]} - int{b.data[i]}));
  }
  return largest;
}

struct RoundTrip {
  ImageFormat format;
  int channels;
  int tolerance;  // of 255
};

class ImageRoundTrip : public ::testing::TestWithParam<RoundTrip> {};

TEST_P(ImageRoundTrip, WrittenImage_ReadsBackWithinTolerance) {
  const auto [format, channels, tolerance] = GetParam();
  const ByteImage image = smooth(61, 37, channels);
  const std::string file = image_bytes(image, format, {.quality = 100});
  const ImageHeader header = read_image_header(bytes_of(file), "test");
  EXPECT_EQ(header.format, format);
  EXPECT_EQ(header.width, 61);
  EXPECT_EQ(header.height, 37);
  EXPECT_EQ(header.orientation, 1);
  const ByteImage back = read_byte_image(bytes_of(file), "test", true);
  ASSERT_EQ(back.width, 61);
  ASSERT_EQ(back.height, 37);
  if (back.channels == channels) {
    EXPECT_LE(largest_difference(image, back), tolerance);
  } else {
    // WebP, BMP and AVIF may keep grey as three equal channels.
    ASSERT_EQ(channels, 1);
    ASSERT_EQ(back.channels, 3);
    for (std::size_t i = 0; i < image.data.size(); ++i) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(back.data[3 * i + c], image.data[i], tolerance);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Formats, ImageRoundTrip,
    ::testing::Values(RoundTrip{ImageFormat::Png, 1, 0}, RoundTrip{ImageFormat::Png, 3, 0},
                      RoundTrip{ImageFormat::Png, 4, 0}, RoundTrip{ImageFormat::Jpeg, 1, 3},
                      RoundTrip{ImageFormat::Jpeg, 3, 12}, RoundTrip{ImageFormat::Tiff, 1, 0},
                      RoundTrip{ImageFormat::Tiff, 3, 0}, RoundTrip{ImageFormat::Tiff, 4, 0},
                      RoundTrip{ImageFormat::WebP, 1, 20}, RoundTrip{ImageFormat::WebP, 3, 20},
                      RoundTrip{ImageFormat::WebP, 4, 20}, RoundTrip{ImageFormat::Bmp, 1, 0},
                      RoundTrip{ImageFormat::Bmp, 3, 0}, RoundTrip{ImageFormat::Avif, 1, 3},
                      RoundTrip{ImageFormat::Avif, 3, 3}, RoundTrip{ImageFormat::Avif, 4, 3}),
    [](const auto& instance) {
      return std::string(format_name(instance.param.format)) +
             std::to_string(instance.param.channels);
    });

TEST(ReadImage, LinearImage_RoundTripsThrough16Bits) {
  Image image(200, 3, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(i) / static_cast<float>(image.data.size());
  }
  for (const ImageFormat format : {ImageFormat::Png, ImageFormat::Tiff}) {
    const std::string file = image_bytes(image, format, {.bit_depth = 16});
    EXPECT_EQ(read_image_header(bytes_of(file), "test").bit_depth, 16);
    const Image back = read_image(bytes_of(file), "test");
    ASSERT_EQ(back.channels, 3);
    for (std::size_t i = 0; i < image.data.size(); ++i) {
      ASSERT_NEAR(back.data[i], image.data[i], 2e-5);
    }
    // And in eight bits as the nearest sRGB byte.
    EXPECT_LE(largest_difference(read_byte_image(bytes_of(file), "test"), srgb_from_linear(image)),
              1);
  }
}

TEST(ReadImage, EightBitPng_MatchesSrgbTransferFunction) {
  const ByteImage bytes = smooth(40, 30, 3);
  const std::string file = image_bytes(bytes, ImageFormat::Png);
  const Image linear = read_image(bytes_of(file), "test");
  const Image expected = linear_from_srgb(bytes);
  for (std::size_t i = 0; i < expected.data.size(); ++i) {
    ASSERT_NEAR(linear.data[i], expected.data[i], 1e-6);
  }
  const Image stored = read_image(bytes_of(file), "test", {.linear = false});
  EXPECT_FLOAT_EQ(stored.data[5], static_cast<float>(bytes.data[5]) / 255.0F);
}

TEST(ReadImage, EveryPngKind_IsDecoded) {
  const auto grey = [](const std::string& file) {
    return read_byte_image(bytes_of(corpus("png/" + file)), file);
  };
  EXPECT_THAT(grey("grey1.png").data, ElementsAre(255, 0, 255, 0, 0, 255, 0, 255,  //
                                                  0, 255, 0, 255, 255, 0, 255, 0));
  EXPECT_THAT(grey("grey2.png").data, ElementsAre(0, 85, 170, 255));
  EXPECT_THAT(grey("grey4.png").data, ElementsAre(0, 255, 119, 170));
  EXPECT_THAT(grey("grey16.png").data, ElementsAre(0, 255));
  EXPECT_THAT(grey("grey_alpha.png").data, ElementsAre(10, 30));
  EXPECT_THAT(grey("palette4.png").data, ElementsAre(0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255,  //
                                                     0, 0, 255, 0, 255, 0, 255, 0, 0, 0, 0, 0));
  const ByteImage adam7 = grey("adam7.png");
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x) {
      EXPECT_EQ(adam7.at(x, y), (x * 32 + y * 3) & 255);
    }
  }
  const Image alpha =
      read_image(bytes_of(corpus("png/rgba16.png")), "rgba16.png", {.keep_alpha = true});
  EXPECT_NEAR(alpha.at(0, 0, 1), 0.2140, 1e-3);
  EXPECT_NEAR(alpha.at(0, 0, 3), 1000.0 / 65535, 1e-6);
  const ByteImage keyed = read_byte_image(bytes_of(corpus("png/rgb_trns.png")), "rgb_trns", true);
  EXPECT_THAT(keyed.data, ElementsAre(1, 2, 3, 0, 4, 5, 6, 255));
  const ByteImage grey_alpha =
      read_byte_image(bytes_of(corpus("png/grey_alpha.png")), "grey_alpha", true);
  EXPECT_THAT(grey_alpha.data, ElementsAre(10, 10, 10, 20, 30, 30, 30, 40));
}

TEST(ReadImage, Orientation_IsReportedNotApplied) {
  const struct {
    const char* file;
    int orientation;
    int width;
    int height;
  } files[] = {{"png/exif6.png", 6, 2, 1},           {"jpeg/exif6.jpg", 6, 16, 12},
               {"tiff/exif3.tif", 3, 16, 12},        {"webp/exif6.webp", 6, 16, 12},
               {"avif/grey_turned.avif", 5, 48, 32}, {"jpeg/small.jpg", 1, 48, 32}};
  for (const auto& file : files) {
    const std::string bytes = corpus(file.file);
    EXPECT_EQ(read_image_header(bytes_of(bytes), file.file).orientation, file.orientation)
        << file.file;
    const ByteImage image = read_byte_image(bytes_of(bytes), file.file);
    EXPECT_EQ(image.width, file.width) << file.file;
    EXPECT_EQ(image.height, file.height) << file.file;
  }
}

TEST(ReadImage, EveryCorpusFile_IsRead) {
  for (const char* format : {"png", "jpeg", "tiff", "webp", "bmp", "avif"}) {
    for (const auto& entry : std::filesystem::directory_iterator(fixtures::source_directory() /
                                                                 "fuzz" / "corpus" / format)) {
      const ImageHeader header = read_image_header(entry.path());
      const Image image = read_image(entry.path(), {.keep_alpha = true});
      EXPECT_EQ(image.width, header.width) << entry.path();
      EXPECT_EQ(image.channels == 4, header.channels == 2 || header.channels == 4) << entry.path();
    }
  }
}

TEST(ReadImage, TenBitAvif_AgreesWithEightBit) {
  const Image ten = read_image(bytes_of(corpus("avif/ten_bit420.avif")), "ten");
  const Image eight = read_image(bytes_of(corpus("avif/small.avif")), "eight");
  double sum = 0;
  for (std::size_t i = 0; i < ten.data.size(); ++i) {
    sum += std::abs(ten.data[i] - eight.data[i]);
  }
  EXPECT_LT(sum / static_cast<double>(ten.data.size()), 0.1);  // 4:2:0 blurs the colours
  EXPECT_EQ(read_image_header(bytes_of(corpus("avif/ten_bit420.avif")), "ten").bit_depth, 10);
}

TEST(ReadImage, TruncatedJpeg_IsRefusedAtEveryLength) {
  // OpenCV decodes all of these without a word.
  for (const char* name : {"small.jpg", "progressive420.jpg", "grey.jpg", "exif6.jpg"}) {
    const std::string file = corpus(std::string("jpeg/") + name);
    for (std::size_t size = 0; size < file.size(); ++size) {
      ASSERT_THROW(read_image(bytes_of(file.substr(0, size)), name), DataError)
          << name << " cut to " << size;
    }
  }
}

TEST(ReadImage, TruncatedFileOfEachFormat_IsRefused) {
  for (const char* name : {"png/small.png", "png/palette4.png", "bmp/small.bmp", "tiff/none.tif",
                           "webp/small.webp", "webp/lossy.webp", "avif/small.avif"}) {
    const std::string file = corpus(name);
    for (std::size_t percent = 0; percent < 100; percent += 5) {
      EXPECT_THROW(read_image(bytes_of(file.substr(0, file.size() * percent / 100)), name),
                   DataError)
          << name << " cut to " << percent << " %";
    }
  }
}

TEST(ReadImage, JpegWithDamageInside_IsRefused) {
  std::string file = corpus("jpeg/small.jpg");
  // A marker in the middle of the scan.
  file[file.size() - 300] = '\xFF';
  file[file.size() - 299] = '\xD9';
  EXPECT_THAT(image_file_refusal(file), HasSubstr("libjpeg"));
}

TEST(ReadImage, PngWithFlippedPixelBit_IsRefused) {
  std::string file = corpus("png/small.png");
  const std::size_t at = file.find("IDAT") + 12;
  file[at] = static_cast<char>(file[at] ^ 1);
  EXPECT_THAT(image_file_refusal(file), HasSubstr("libpng"));
}

TEST(ReadImage, ImageBeyondLimits_IsRefusedBeforeDecoding) {
  Limits limits;
  limits.image_side = 40;
  for (const char* name : {"jpeg/small.jpg", "webp/lossy.webp", "avif/small.avif"}) {
    EXPECT_THROW(read_image(bytes_of(corpus(name)), name, {}, limits), DataError) << name;
  }
  limits = {};
  limits.image_pixels = 20;
  for (const char* name : {"png/small.png", "tiff/none.tif", "bmp/small.bmp", "jpeg/small.jpg",
                           "webp/lossy.webp", "avif/small.avif"}) {
    EXPECT_THROW(read_image(bytes_of(corpus(name)), name, {}, limits), DataError) << name;
  }
  limits = {};
  limits.image_file_bytes = 20;
  EXPECT_THAT(image_file_refusal(corpus("png/small.png"), limits), HasSubstr("at most 20"));
  // A few bytes that promise an image of 60 million pixels.
  std::string bomb = corpus("png/small.png");
  bomb.replace(16, 8, std::string("\0\0\x1f\x40\0\0\x1f\x40", 8));
  EXPECT_THAT(image_file_refusal(bomb), HasSubstr("8000 x 8000 pixels in 188 bytes"));
}

/// A TIFF file (little endian) with one more directory, whose subfile type is given.
std::string with_page(std::string tiff, unsigned type) {
  const auto number = [&](std::size_t at, int bytes) {
    std::size_t value = 0;
    for (int i = 0; i < bytes; ++i) {
      value |= std::size_t{static_cast<unsigned char>(tiff[at + i])} << (8 * i);
    }
    return value;
  };
  const auto text = [](std::size_t value, int bytes) {
    std::string little;
    for (int i = 0; i < bytes; ++i) {
      little += static_cast<char>(value >> (8 * i) & 255);
    }
    return little;
  };
  const std::size_t directory = number(4, 4);
  const std::size_t next = directory + 2 + 12 * number(directory, 2);
  tiff.resize(std::max(tiff.size() + tiff.size() % 2, next + 4));
  tiff.replace(next, 4, text(tiff.size(), 4));
  return tiff + text(1, 2) + text(254, 2) + text(4, 2) + text(1, 4) + text(type, 4) + text(0, 4);
}

TEST(ReadImage, SecondTiffPage_IsRefusedButThumbnailIsNot) {
  const std::string one = corpus("tiff/none.tif");
  ASSERT_EQ(one.substr(0, 2), "II");
  EXPECT_THAT(image_file_refusal(with_page(one, 0)), HasSubstr("a second page"));
  EXPECT_THAT(image_file_refusal(with_page(one, 2)), HasSubstr("a second page"));
  EXPECT_EQ(read_image(bytes_of(with_page(one, 1)), "thumbnail").data,
            read_image(bytes_of(one), "one").data);
}

TEST(ReadImage, UnknownFormatOrMissingFile_IsRefused) {
  EXPECT_THAT(image_file_refusal(""), HasSubstr("no known image format"));
  EXPECT_THAT(image_file_refusal("GIF89a"), HasSubstr("no known image format"));
  EXPECT_THAT(image_file_refusal("\x76\x2f\x31\x01 OpenEXR"), HasSubstr("no known image format"));
  EXPECT_THAT(image_file_refusal("P6 1 1 255 abc"), HasSubstr("no known image format"));
  const TemporaryDirectory folder;
  EXPECT_THROW(read_image(folder / "absent.png"), DataError);
  EXPECT_THROW(read_image(folder.path()), DataError);
}

TEST(ReadLabels, PaletteIndex_IsTheLabel) {
  const ByteImage labels = read_labels(bytes_of(corpus("png/palette4.png")), "palette4.png");
  EXPECT_EQ(labels.channels, 1);
  EXPECT_THAT(labels.data, ElementsAre(0, 1, 2, 3, 3, 2, 1, 0));
  EXPECT_THAT(read_labels(bytes_of(corpus("png/grey4.png")), "grey4").data,
              ElementsAre(0, 15, 7, 10));
  EXPECT_THAT(read_labels(bytes_of(corpus("png/grey2.png")), "grey2").data,
              ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(read_labels(bytes_of(corpus("png/grey16_labels.png")), "grey16").data,
              ElementsAre(7, 255));
}

TEST(ReadLabels, ImageThatIsNoLabelMap_IsRefused) {
  for (const char* name : {"png/small.png", "png/grey_alpha.png", "png/grey16.png", "jpeg/grey.jpg",
                           "webp/small.webp", "bmp/palette.bmp", "tiff/palette.tif"}) {
    EXPECT_THROW(read_labels(bytes_of(corpus(name)), name), DataError) << name;
  }
}

TEST(WriteLabels, AllLabels_RoundTripWithDistinctColors) {
  const TemporaryDirectory folder;
  ByteImage labels(16, 16, 1);
  for (int i = 0; i < 256; ++i) {
    labels.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(i);
  }
  write_labels(folder / "labels.png", labels);
  EXPECT_EQ(read_labels(folder / "labels.png").data, labels.data);
  const ByteImage colors = read_byte_image(folder / "labels.png");
  std::set<std::array<std::uint8_t, 3>> distinct;
  for (int i = 0; i < 32; ++i) {
    const std::uint8_t* c = &colors.data[static_cast<std::size_t>(3 * i)];
    distinct.insert({c[0], c[1], c[2]});
  }
  EXPECT_EQ(distinct.size(), 32u);
  EXPECT_THROW(write_labels(folder / "labels.jpg", labels), LogicError);
  EXPECT_THROW(label_bytes(ByteImage(2, 2, 3)), LogicError);
}

TEST(WriteImage, UnwritableImageOrOptions_AreRefused) {
  const TemporaryDirectory folder;
  EXPECT_THROW(write_image(folder / "a.gif", ByteImage(2, 2, 3)), LogicError);
  EXPECT_THROW(write_image(folder / "a.exr", ByteImage(2, 2, 3)), LogicError);
  EXPECT_THROW(write_image(folder / "a.png", ByteImage()), LogicError);
  EXPECT_THROW(write_image(folder / "a.png", ByteImage(2, 2, 2)), LogicError);
  EXPECT_THROW(write_image(folder / "a.jpg", ByteImage(2, 2, 4)), LogicError);
  EXPECT_THROW(write_image(folder / "a.bmp", ByteImage(2, 2, 4)), LogicError);
  EXPECT_THROW(write_image(folder / "a.jpg", ByteImage(2, 2, 3), {.quality = 0}), LogicError);
  EXPECT_THROW(write_image(folder / "a.jpg", Image(2, 2, 3), {.bit_depth = 16}), LogicError);
  EXPECT_THROW(write_image(folder / "a.png", Image(2, 2, 3), {.bit_depth = 12}), LogicError);
  Image broken(2, 2, 1);
  broken.data[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(write_image(folder / "a.png", broken), LogicError);
  broken.data.pop_back();
  EXPECT_THROW(write_image(folder / "a.png", broken), LogicError);
  EXPECT_THROW(write_image(folder / "absent" / "a.png", ByteImage(2, 2, 3)), EnvironmentError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(WriteImage, EverySupportedExtension_RoundTrips) {
  const TemporaryDirectory folder;
  for (const char* name :
       {"a.png", "a.jpg", "a.JPEG", "a.tif", "a.tiff", "a.webp", "a.bmp", "a.avif"}) {
    write_image(folder / name, Image(8, 6, 3, 0.5F));
    const Image back = read_image(folder / name);
    EXPECT_NEAR(back.at(3, 3, 1), 0.5, 0.02) << name;
  }
}

TEST(RealImages, HumanParsingLabels_KeepTheirIds) {
  // SCHP demo results: LIP has 20 classes, ATR 18, Pascal 7.
  const struct {
    const char* file;
    int classes;
  } files[] = {{"demo_lip.png", 20}, {"demo_atr.png", 18}, {"demo_pascal.png", 7}};
  for (const auto& file : files) {
    ATELIER_TEST_FILE(path, std::string("human_parsing_labels/") + file.file);
    const ByteImage labels = read_labels(path);
    EXPECT_EQ(labels.width, 2000);
    EXPECT_EQ(labels.height, 1333);
    EXPECT_LT(*std::max_element(labels.data.begin(), labels.data.end()), file.classes) << file.file;
    EXPECT_GT(std::count(labels.data.begin(), labels.data.end(), 0), 1'000'000) << file.file;
    EXPECT_GT(*std::max_element(labels.data.begin(), labels.data.end()), 3) << file.file;
  }
}

TEST(RealImages, PhotographsAndTextures_AreRead) {
  ATELIER_TEST_FILE(photo, "caliscope_calib/chessboard_intrinsic_stills/cam_0_frame_000.jpg");
  const Image image = read_image(photo);
  EXPECT_EQ(image.channels, 3);
  EXPECT_GT(image.width, 300);
  ATELIER_TEST_FILE(texture, "makehuman/eyes/brown_eye.png");
  EXPECT_GT(read_image(texture).width, 100);
}

TEST(ImageFile, ImageTooLargeToReadBack_IsRefusedOnWrite) {
  const TemporaryDirectory folder;
  for (const auto& [width, height] : {std::pair{16'385, 1}, {1, 16'385}, {8'001, 8'000}}) {
    try {
      write_image(folder / "large.png", ByteImage(width, height, 1));
      FAIL() << width << " x " << height << " was written";
    } catch (const DataError& error) {
      EXPECT_NE(std::string(error.what()).find("at most 64000000 pixels"), std::string::npos);
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "large.png"));
}

}  // namespace
}  // namespace atelier

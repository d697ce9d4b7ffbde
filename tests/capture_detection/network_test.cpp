// Tiny networks whose answers are known, through OpenCV and the decoders; hostile ones refused.

#include "capture/detection/network.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/detection/decode.h"
#include "core/error.h"
#include "tests/capture_detection/small_network.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 24;
constexpr int kHeight = 32;

/// Channel c has a blob at (x, y): a parabola with its top there.
void put_blob(Image& image, int channel, double x, double y, double top = 0.9) {
  for (int py = 0; py < image.height; ++py) {
    for (int px = 0; px < image.width; ++px) {
      const double d2 = std::pow(px + 0.5 - x, 2) + std::pow(py + 0.5 - y, 2);
      image.at(px, py, channel) =
          std::max(image.at(px, py, channel), static_cast<float>(std::max(0.0, top - 0.02 * d2)));
    }
  }
}

Image three_blobs() {
  Image image(kWidth, kHeight, 3);
  put_blob(image, 0, 5.7, 6.3);
  put_blob(image, 1, 15.2, 20.9);
  put_blob(image, 2, 20.5, 9.5, 0.4);
  return image;
}

const std::vector<std::vector<float>> kNetworkEach = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

TEST(Network, Heatmaps_GiveTheDrawnPoints) {
  const auto outputs = run_network(onnx_bytes(mixing_network(kNetworkEach, kWidth, kHeight)),
                                   {{three_blobs()}}, "small.onnx");
  ASSERT_EQ(outputs.size(), 1U);
  ASSERT_EQ(outputs[0].size(), 1U);
  EXPECT_EQ(outputs[0][0].shape, (std::vector<int>{3, kHeight, kWidth}));
  const DetectedPoints points = decode_heatmaps(outputs[0][0], 3, kWidth, kHeight);
  EXPECT_NEAR(points(0, 0), 5.7, 1e-3);
  EXPECT_NEAR(points(0, 1), 6.3, 1e-3);
  EXPECT_NEAR(points(1, 0), 15.2, 1e-3);
  EXPECT_NEAR(points(2, 1), 9.5, 1e-3);
  EXPECT_NEAR(points(2, 2), 0.4, 1e-3);
}

TEST(Network, Simcc_GivesTheDrawnPixels) {
  const auto outputs = run_network(onnx_bytes(simcc_network(kNetworkEach, kWidth, kHeight)),
                                   {{three_blobs()}, {three_blobs()}}, "small.onnx");
  ASSERT_EQ(outputs.size(), 2U);
  ASSERT_EQ(outputs[1].size(), 2U);
  for (const auto& one : outputs) {
    const DetectedPoints points = decode_simcc(one[0], one[1], kWidth, kHeight);
    EXPECT_EQ(points(0, 0), 5.5);
    EXPECT_EQ(points(0, 1), 6.5);
    EXPECT_EQ(points(1, 0), 15.5);
    EXPECT_EQ(points(1, 1), 20.5);
  }
}

TEST(Network, Parsing_GivesTheClassOfEachPixel) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      image.at(x, y, x < 8 ? 0 : x < 16 ? 1 : 2) = 1;
    }
  }
  const auto outputs = run_network(onnx_bytes(mixing_network(kNetworkEach, kWidth, kHeight)),
                                   {{image}}, "small.onnx");
  const ByteImage labels = decode_parsing(outputs[0][0], 2 * kWidth, 2 * kHeight);
  EXPECT_EQ(labels.at(4, 10), 0);
  EXPECT_EQ(labels.at(24, 10), 1);
  EXPECT_EQ(labels.at(44, 60), 2);
}

TEST(Network, HostileFile_IsRefused) {
  const NetworkInput input{three_blobs()};
  const auto refused = [&](const std::vector<std::byte>& model) {
    try {
      run_network(model, {input}, "bad.onnx");
    } catch (const DataError& error) {
      EXPECT_EQ(error.file, "bad.onnx");
      return true;
    }
    return false;
  };
  EXPECT_TRUE(refused({}));
  EXPECT_TRUE(refused(std::vector<std::byte>(1000, std::byte{0xFF})));
  const std::vector<std::byte> good = onnx_bytes(mixing_network(kNetworkEach, kWidth, kHeight));
  int cut_refused = 0;
  for (std::size_t cut = 1; cut < good.size(); cut += 23) {
    cut_refused += refused({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(cut)}) ? 1 : 0;
  }
  EXPECT_GT(cut_refused, 5);
  // An operator that nobody knows, and a tensor that says it is larger than the file.
  SmallNetwork strange = mixing_network(kNetworkEach, kWidth, kHeight);
  strange.nodes = {node("Frobnicate", {"input"}, "maps")};
  EXPECT_TRUE(refused(onnx_bytes(strange)));
  SmallNetwork vast = mixing_network(kNetworkEach, kWidth, kHeight);
  vast.initializers = {tensor("w", {1LL << 20, 1LL << 20, 1, 1}, {1, 2, 3})};
  EXPECT_TRUE(refused(onnx_bytes(vast)));
}

TEST(Network, FlippedByte_EndsInAnswerOrRefusal) {
  const std::vector<std::byte> good = onnx_bytes(mixing_network(kNetworkEach, 8, 8));
  for (std::size_t at = 0; at < good.size(); at += 11) {
    std::vector<std::byte> damaged = good;
    damaged[at] ^= std::byte{0x41};
    try {
      run_network(damaged, {{Image(8, 8, 3, 0.5F)}}, "damaged.onnx");
    } catch (const DataError& error) {
      EXPECT_EQ(error.file, "damaged.onnx");
    }
  }
}

TEST(Network, BadInputImage_IsRefused) {
  const std::vector<std::byte> good = onnx_bytes(mixing_network(kNetworkEach, 8, 8));
  ATELIER_EXPECT_REFUSED(run_network(good, {{Image(8, 8, 1)}}, "x"), LogicError, "three channels");
  ATELIER_EXPECT_REFUSED(run_network(good, {{Image()}}, "x"), LogicError, "has pixels");
  Image nan(8, 8, 3, std::nanf(""));
  ATELIER_EXPECT_REFUSED(run_network(good, {{nan}}, "x"), DataError, "not finite");
}

NetworkOutput zeros(std::vector<int> shape) {
  NetworkOutput output{"maps", std::move(shape), {}};
  std::size_t total = 1;
  for (const int side : output.shape) {
    total *= static_cast<std::size_t>(side);
  }
  output.values.assign(total, 0.0F);
  return output;
}

TEST(Decode, TensorsOfOtherShape_AreRefused) {
  ATELIER_EXPECT_REFUSED(decode_heatmaps(zeros({3, 8}), 3, 8, 8), DataError, "shape [1,3,8]");
  ATELIER_EXPECT_REFUSED(decode_heatmaps(zeros({3, 8, 8}), 17, 8, 8), DataError,
                         "[1,17 or more,h,w]");
  ATELIER_EXPECT_REFUSED(decode_simcc(zeros({3, 12}), zeros({3, 8}), 8, 8), DataError,
                         "[1,K,n x 8]");
  ATELIER_EXPECT_REFUSED(decode_simcc(zeros({3, 16}), zeros({4, 16}), 8, 8), DataError,
                         "[1,3,n x 8]");
  ATELIER_EXPECT_REFUSED(decode_parsing(zeros({1, 8, 8}), 8, 8), DataError, "2 to 250 classes");
  ATELIER_EXPECT_REFUSED(decode_openpose_people(zeros({38, 8, 8}), 8, 8), DataError, "[1,57,h,w]");
  NetworkOutput lying = zeros({3, 8, 8});
  lying.values.pop_back();
  ATELIER_EXPECT_REFUSED(decode_heatmaps(lying, 3, 8, 8), LogicError, "as the shape says");
}

/// Two stick people as OpenPose's maps have them.
TEST(Decode, OpenPoseFields_SeparateTwoPeople) {
  constexpr int kSide = 64;
  NetworkOutput maps = zeros({57, kSide, kSide});
  const auto at = [&](int map, int x, int y) -> float& {
    return maps.values[static_cast<std::size_t>((map * kSide + y) * kSide + x)];
  };
  // Neck, both shoulders, elbows and hips of each person; the first stands in front of the second.
  struct Joint {
    int k;
    int x;
    int y;
  };
  const Joint joints[] = {{1, 16, 14}, {2, 10, 15}, {5, 22, 15}, {3, 8, 25},
                          {6, 24, 25}, {8, 12, 32}, {11, 20, 32}};
  struct Limb {
    int from;
    int to;
    int field;
  };
  const Limb limbs[] = {{1, 2, 31}, {1, 5, 39}, {2, 3, 33}, {5, 6, 41}, {1, 8, 19}, {1, 11, 25}};
  for (const int shift : {0, 20}) {
    const auto place = [&](int k) {
      for (const Joint& joint : joints) {
        if (joint.k == k) {
          return std::pair<int, int>(joint.x + shift, joint.y);
        }
      }
      return std::pair<int, int>(0, 0);
    };
    for (const Joint& joint : joints) {
      at(joint.k, joint.x + shift, joint.y) = shift == 0 ? 0.9F : 0.8F;
    }
    for (const Limb& limb : limbs) {
      const auto [x0, y0] = place(limb.from);
      const auto [x1, y1] = place(limb.to);
      const double length = std::hypot(x1 - x0, y1 - y0);
      for (int i = 0; i <= 40; ++i) {
        const int x = static_cast<int>(std::lround(x0 + (x1 - x0) * i / 40.0));
        const int y = static_cast<int>(std::lround(y0 + (y1 - y0) * i / 40.0));
        at(limb.field, x, y) = static_cast<float>((x1 - x0) / length);
        at(limb.field + 1, x, y) = static_cast<float>((y1 - y0) / length);
      }
    }
  }
  const auto people = decode_openpose_people(maps, 2 * kSide, 2 * kSide);
  ASSERT_EQ(people.size(), 2U);
  for (std::size_t p = 0; p < 2; ++p) {
    const double shift = p == 0 ? 0 : 20;
    EXPECT_NEAR(people[p](1, 0), 2 * (16.5 + shift), 1e-6);
    EXPECT_NEAR(people[p](3, 0), 2 * (8.5 + shift), 1e-6);
    EXPECT_NEAR(people[p](6, 0), 2 * (24.5 + shift), 1e-6);
    EXPECT_EQ(people[p](0, 2), 0);  // no nose
  }
  EXPECT_TRUE(decode_openpose_people(zeros({57, 8, 8}), 8, 8).empty());
}

}  // namespace
}  // namespace atelier::fixtures

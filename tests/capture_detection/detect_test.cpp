// From an image through a network back to the image: boxes, normalisation, every kind.

#include "capture/detection/detect.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/capture_detection/small_network.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

const std::vector<std::vector<float>> kEach = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

/// A dark image with a red, a green and a blue disk.
ByteImage discs() {
  ByteImage image(120, 100, 3);
  const double at[3][2] = {{40, 30}, {70, 52}, {60, 80}};
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const double d2 = std::pow(x + 0.5 - at[c][0], 2) + std::pow(y + 0.5 - at[c][1], 2);
        image.at(x, y, c) = static_cast<std::uint8_t>(std::lround(230 * std::exp(-d2 / 30)));
      }
    }
  }
  return image;
}

DetectOptions small_options(NetworkKind kind) {
  DetectOptions options;
  options.kind = kind;
  options.width = 48;
  options.height = 64;
  options.mean = {0, 0, 0};
  options.standard_deviation = {255, 255, 255};
  return options;
}

TEST(Detect, DetectedPoints_AreInImageCoordinates) {
  const DetectPicture whole{discs(), whole_box(120, 100)};
  const DetectPicture part{discs(), {20, 10, 70, 85}};
  for (const NetworkKind kind : {NetworkKind::Heatmap, NetworkKind::Simcc}) {
    const DetectOptions options = small_options(kind);
    const auto model = onnx_bytes(kind == NetworkKind::Simcc
                                      ? simcc_network(kEach, options.width, options.height)
                                      : mixing_network(kEach, options.width, options.height));
    const auto found = detect(model, {whole, part}, options, "small.onnx");
    ASSERT_EQ(found.size(), 2U);
    for (const Detection& one : found) {
      ASSERT_EQ(one.people.size(), 1U);
      // Half a pixel of the network is 1.25 pixels of the whole picture.
      const double error = kind == NetworkKind::Simcc ? 1.3 : 0.5;
      EXPECT_NEAR(one.people[0](0, 0), 40, error);
      EXPECT_NEAR(one.people[0](0, 1), 30, error);
      EXPECT_NEAR(one.people[0](1, 0), 70, error);
      EXPECT_NEAR(one.people[0](2, 1), 80, error);
    }
  }
}

TEST(Detect, ChannelOrderAndNormalization_AreApplied) {
  DetectOptions options = small_options(NetworkKind::Heatmap);
  options.bgr = true;
  const auto model = onnx_bytes(mixing_network(kEach, options.width, options.height));
  const DetectPicture whole{discs(), whole_box(120, 100)};
  const auto found = detect(model, {whole}, options, "small.onnx");
  EXPECT_NEAR(found[0].people[0](0, 0), 60, 0.5);  // blue comes first
  options.bgr = false;
  options.mean = {230, 230, 230};  // nothing is above it
  const auto none = detect(model, {whole}, options, "small.onnx");
  EXPECT_EQ(none[0].people[0].norm(), 0);
}

TEST(Detect, SimccOutputsInOtherOrder_AreRecognized) {
  const DetectOptions options = small_options(NetworkKind::Simcc);
  SmallNetwork network = simcc_network(kEach, options.width, options.height);
  std::swap(network.outputs[0], network.outputs[1]);
  std::swap(network.nodes[3], network.nodes[4]);
  const auto found = detect(onnx_bytes(network), {{discs(), whole_box(120, 100)}}, options, "s");
  EXPECT_NEAR(found[0].people[0](1, 0), 70, 1.3);
  EXPECT_NEAR(found[0].people[0](1, 1), 52, 1.3);
}

TEST(Detect, ParsedClasses_CoverOnlyTheBox) {
  DetectOptions options = small_options(NetworkKind::Parsing);
  const auto model = onnx_bytes(mixing_network(
      {{0.2F, 0.2F, 0.2F}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, options.width, options.height));
  const auto found = detect(model, {{discs(), {30, 20, 24, 24}}}, options, "small.onnx");
  EXPECT_EQ(found[0].class_count, 4);
  EXPECT_EQ(found[0].classes.width, 120);
  EXPECT_EQ(found[0].classes.at(40, 30), 1);
  EXPECT_EQ(found[0].classes.at(60, 80), 0);
}

TEST(Detect, MaskBox_EnclosesTheMask) {
  ByteImage mask(100, 80, 1);
  mask.at(10, 20) = 255;
  mask.at(29, 59) = 255;
  const DetectBox box = mask_box(mask, 1.5);
  EXPECT_DOUBLE_EQ(box.x, 5);
  EXPECT_DOUBLE_EQ(box.y, 10);
  EXPECT_DOUBLE_EQ(box.width, 30);
  EXPECT_DOUBLE_EQ(box.height, 60);
  EXPECT_DOUBLE_EQ(mask_box(ByteImage(100, 80, 1), 1.5).width, 100);
}

TEST(Detect, MismatchedNetworkOrOptions_AreRefused) {
  const DetectOptions options = small_options(NetworkKind::Simcc);
  const auto one_output = onnx_bytes(mixing_network(kEach, options.width, options.height));
  const DetectPicture whole{discs(), whole_box(120, 100)};
  ATELIER_EXPECT_REFUSED(detect(one_output, {whole}, options, "a.onnx"), DataError,
                         "SimCC's rows for x and for y");
  ATELIER_EXPECT_REFUSED(
      detect(one_output, {whole}, small_options(NetworkKind::OpenPose), "a.onnx"), DataError,
      "[1,57,h,w]");
  DetectOptions many = small_options(NetworkKind::Heatmap);
  many.points = 17;
  ATELIER_EXPECT_REFUSED(detect(one_output, {whole}, many, "a.onnx"), DataError, "17 or more");
  ATELIER_EXPECT_REFUSED(detect(one_output, {{discs(), {0, 0, 0, 5}}}, options, "a"), LogicError,
                         "without area");
  DetectOptions two = options;
  two.mean = {1, 2};
  ATELIER_EXPECT_REFUSED(detect(one_output, {whole}, two, "a"), LogicError, "three means");
}

}  // namespace
}  // namespace atelier::fixtures

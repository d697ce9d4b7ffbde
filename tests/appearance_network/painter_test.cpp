#include "appearance/network/painter.h"

#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/network/network.h"
#include "appearance/network/train.h"
#include "core/error.h"
#include "tests/appearance_network/appearance_fixture.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using fixtures::small_data;

constexpr int kSide = 32;

Camera above() {
  Camera camera;
  camera.id = "above";
  camera.width = camera.height = kSide;
  camera.fx = camera.fy = 1.2 * kSide;
  camera.cx = camera.cy = kSide / 2.0;
  camera.camera_from_world_rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  camera.camera_from_world_translation = {-0.5, -0.5, 2};
  return camera;
}

/// The fixture's sheet with a network, and a smaller plain one above a part of it.
struct Stage {
  AppearanceData data = small_data();
  std::shared_ptr<const AppearanceModel> model;
  Mesh lid = fixtures::grid(1, 1);
  Points sheet = data.frames[1].position.cast<double>();

  Stage() {
    NetworkOptions options;
    options.resolution = 16;
    options.channels = 2;
    model = std::make_shared<const AppearanceModel>(initial_model(data, options, 1));
    lid.vertices = 0.3 * lid.vertices;
    lid.vertices.col(0).array() += 0.3;
    lid.vertices.col(1).array() += 0.4;
    lid.vertices.col(2).array() += 0.3;
  }
  std::vector<PaintedLayer> layers() const {
    return {{data.faces, model}, {lid.faces, nullptr, {0.0F, 0.5F, 0.0F}}};
  }
};

TEST(Painter, Layers_AreCompositedByDepthOverBackground) {
  const Stage stage;
  PaintOptions options;
  options.background = {0.2, 0.3, 0.4};
  Painter painter(stage.layers(), options, Device::Cpu);
  const Image picture = painter.paint({stage.sheet, stage.lid.vertices}, above());
  ASSERT_EQ(picture.width, kSide);
  ASSERT_EQ(picture.channels, 4);
  EXPECT_FLOAT_EQ(picture.at(0, 0, 0), 0.2F);
  EXPECT_FLOAT_EQ(picture.at(0, 0, 2), 0.4F);
  EXPECT_EQ(picture.at(0, 0, 3), 1.0F);
  EXPECT_NEAR(picture.at(16, 15, 1), 0.5F, 0.02F);  // the lid, under an open sky
  EXPECT_EQ(picture.at(16, 15, 0), 0.0F);
  EXPECT_GT(picture.at(6, 16, 0), 0.0F);  // the sheet beside it
  // The order of layers does not matter, what is near does.
  Painter turned({stage.layers()[1], stage.layers()[0]}, options, Device::Cpu);
  const Image same = turned.paint({stage.lid.vertices, stage.sheet}, above());
  for (std::size_t i = 0; i < same.data.size(); ++i) {
    EXPECT_NEAR(same.data[i], picture.data[i], 1e-5F);
  }
}

TEST(Painter, Alpha_IsCoverageAndColorsArePremultiplied) {
  const Stage stage;
  PaintOptions options;
  options.alpha = true;
  options.samples = 4;
  Painter painter({stage.layers()[1]}, options, Device::Cpu);
  const Image picture = painter.paint({stage.lid.vertices}, above());
  double covered = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const float* pixel = &picture.data[4 * static_cast<std::size_t>(i)];
    covered += pixel[3];
    EXPECT_NEAR(pixel[1], 0.5F * pixel[3], 1e-5F);
  }
  // 0.3 m at 1.6 m through 1.2 x 32 pixels.
  const double side = 0.3 / 1.6 * 1.2 * kSide;
  EXPECT_NEAR(covered, side * side, 0.05 * side * side);
  EXPECT_EQ(picture.at(0, 0, 3), 0.0F);
}

TEST(Painter, MovingSurface_IsPaintedAsByAFreshPainter) {
  const Stage stage;
  PaintOptions options;
  options.samples = 1;
  Painter painter({stage.layers()[0]}, options, Device::Cpu);
  Painter fresh({stage.layers()[0]}, options, Device::Cpu);
  painter.paint({stage.sheet}, above());
  const Points moved = stage.sheet.array() + 0.1;
  // A tree that followed gives what a new one does; a frame without the garment is empty.
  EXPECT_EQ(painter.paint({moved}, above()).data, fresh.paint({moved}, above()).data);
  const Image nothing = painter.paint({Points(0, 3)}, above());
  EXPECT_FLOAT_EQ(nothing.at(16, 16, 0), 0.9F);
  EXPECT_EQ(painter.paint({moved}, above()).data, fresh.paint({moved}, above()).data);
}

TEST(Painter, Occlusion_IsMeasuredAsInTraining) {
  const Stage stage;
  AppearanceModel model = *stage.model;
  // A shadow network that says what it is given: without rays that meet the lid there is no shadow.
  for (auto& [name, tensor] : model.parameters) {
    if (name.ends_with(".last.g")) {
      tensor = tensor_of(std::vector<float>(tensor.data.size() / 4, 3.0F), tensor.shape);
    }
  }
  const auto picture = [&](const std::optional<OcclusionOptions>& learnt,
                           const OcclusionOptions& asked) {
    AppearanceModel one = model;
    one.occlusion = learnt;
    PaintOptions options;
    options.samples = 1;
    options.occlusion = asked;
    Painter painter({{stage.data.faces, std::make_shared<const AppearanceModel>(one)},
                     {stage.lid.faces, nullptr, {0.0F, 0.5F, 0.0F}}},
                    options, Device::Cpu);
    return painter.paint({stage.sheet, stage.lid.vertices}, above()).data;
  };
  const OcclusionOptions usual;
  const OcclusionOptions near_sighted = {8, 0.01, 0.002};
  const auto as_it_comes = picture(usual, kOpenOcclusion);
  const auto without_shadow = picture(near_sighted, kOpenOcclusion);
  EXPECT_NE(as_it_comes, without_shadow);
  EXPECT_EQ(picture({}, kOpenOcclusion), as_it_comes);  // of an older program
  EXPECT_EQ(picture({}, near_sighted), without_shadow);
  EXPECT_EQ(picture(near_sighted, near_sighted), without_shadow);
  ATELIER_EXPECT_REFUSED(picture(usual, near_sighted), DataError, "occlusion.reach cannot be 0.01");
}

TEST(Network, InsideOfCloth_IsLitByItsOwnSide) {
  // The same sheet from above and from below; below it is dark.
  const Stage stage;
  AppearanceModel model = *stage.model;
  for (auto& [name, tensor] : model.parameters) {
    if (name.ends_with(".last.g")) {
      tensor = tensor_of(std::vector<float>(tensor.data.size() / 4, 0.3F), tensor.shape);
    }
  }
  const AppearanceNetwork network(model, Device::Cpu);
  SurfaceFrame frame = stage.data.frames[0];
  const Eigen::Vector3d below(0.5, -3, 0.5);
  const Image one = network.texture(frame, below);
  frame.transfer.leftCols<kTransferTerms>().setConstant(0.1F);  // of the outside: nobody there
  EXPECT_EQ(network.texture(frame, below).data, one.data);
  frame.transfer.rightCols<kTransferTerms>().setConstant(0.1F);
  EXPECT_NE(network.texture(frame, below).data, one.data);
}

TEST(PainterRefused, MismatchedLayersOrOptions_AreRefused) {
  const Stage stage;
  const Triangles fewer = stage.data.faces.topRows(3);
  ATELIER_EXPECT_REFUSED(Painter({{fewer, stage.model}}, {}, Device::Cpu), DataError,
                         "surface that it is to draw");
  PaintOptions options;
  options.background = {1};
  ATELIER_EXPECT_REFUSED(Painter(stage.layers(), options, Device::Cpu), LogicError, "out of range");
  Painter painter(stage.layers(), {}, Device::Cpu);
  ATELIER_EXPECT_REFUSED(painter.paint({stage.sheet}, above()), LogicError, "every layer");
  ATELIER_EXPECT_REFUSED(painter.paint({stage.sheet.topRows(4), stage.lid.vertices}, above()),
                         DataError, "4 vertices; expected");
  Camera camera = above();
  camera.fx = 0;
  ATELIER_EXPECT_REFUSED(painter.paint({stage.sheet, stage.lid.vertices}, camera), DataError, "");
}

}  // namespace
}  // namespace atelier

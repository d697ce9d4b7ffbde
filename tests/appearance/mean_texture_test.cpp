#include "appearance/mean_texture.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/packed_atlas.h"
#include "appearance/prepare.h"
#include "appearance/psnr.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr int kPipeSide = 96;

/// A sheet that is bent to a half pipe, painted in a smooth pattern, before cameras round it.
struct PaintedPipe {
  Mesh pipe = fixtures::grid(16, 16);
  DressedSubject subject;
  DrawnSurface surface;
  std::vector<Camera> cameras;

  PaintedPipe() {
    pipe.uvs.resize(pipe.vertices.rows(), 2);
    pipe.uvs.col(0) = pipe.vertices.col(0);
    pipe.uvs.col(1) = 1 - pipe.vertices.col(2).array();
    pipe.uv_faces = pipe.faces;
    for (Index v = 0; v < pipe.vertices.rows(); ++v) {
      const double angle = std::numbers::pi * (pipe.vertices(v, 0) - 0.5);
      pipe.vertices.row(v) << 0.4 * std::sin(angle), 0.4 * std::cos(angle),
          pipe.vertices(v, 2) - 0.5;
    }
    subject.names = {"body"};
    subject.faces = {pipe.faces};
    subject.load = [this](int) { return std::vector<Points>{pipe.vertices}; };
    surface.atlas = {pipe.uvs, pipe.uv_faces, std::vector<int>(256, 0)};
    for (int i = 0; i < 5; ++i) {
      const double angle = 0.6 * (i - 2);
      Camera camera;
      camera.id = std::to_string(i);
      camera.width = camera.height = kPipeSide;
      camera.fx = camera.fy = 1.6 * kPipeSide;
      camera.cx = camera.cy = kPipeSide / 2.0;
      const Eigen::Vector3d forward(-std::sin(angle), -std::cos(angle), 0);
      const Eigen::Vector3d down(0, 0, 1);
      camera.camera_from_world_rotation.row(0) = down.cross(forward).transpose();
      camera.camera_from_world_rotation.row(1) = down.transpose();
      camera.camera_from_world_rotation.row(2) = forward.transpose();
      camera.camera_from_world_translation = {0, 0, 2};
      cameras.push_back(camera);
    }
  }

  static double paint(double u, double v, int channel) {
    return 0.4 + 0.25 * std::sin(2 * std::numbers::pi * ((channel + 1) * u + channel * v));
  }

  /// The data of what cameras would take of it; of one camera `wrong` where it looks along it.
  AppearanceData data(bool wrong_at_grazing = false) const {
    PrepareAppearanceOptions options;
    options.occlusion.strata = 2;
    options.visible.erosion = 1;
    options.visible.depth_jump = 1;  // grazing pixels are there to be weighted
    AppearanceData data = prepare_appearance(subject, surface, {cameras, {1}}, options);
    const std::vector<std::vector<float>> weights = angle_weights(data);
    for (std::size_t i = 0; i < data.views.size(); ++i) {
      AppearanceView& view = data.views[i];
      Image colors(static_cast<int>(view.u.size()), 1, 3);
      for (std::size_t p = 0; p < view.u.size(); ++p) {
        for (int c = 0; c < 3; ++c) {
          const bool wrong = wrong_at_grazing && weights[i][p] < 0.15F;
          colors.data[3 * p + static_cast<std::size_t>(c)] =
              static_cast<float>(wrong ? 0.0 : paint(view.u[p], view.v[p], c));
        }
      }
      view.colors = srgb_from_linear(colors).data;
    }
    return data;
  }

  /// Mean squared error of a texture where the pipe has been seen, in linear light.
  double error(const Image& texture) const {
    double squares = 0;
    double count = 0;
    for (int y = texture.height / 8; y < texture.height * 7 / 8; ++y) {
      for (int x = texture.width / 8; x < texture.width * 7 / 8; ++x) {
        for (int c = 0; c < 3; ++c) {
          const double wanted = paint((x + 0.5) / texture.width, 1 - (y + 0.5) / texture.height, c);
          squares += (texture.at(x, y, c) - wanted) * (texture.at(x, y, c) - wanted);
          count += 1;
        }
      }
    }
    return squares / count;
  }
};

TEST(MeanTexture, PaintedBody_GivesItsTextureBack) {
  const PaintedPipe pipe;
  const AppearanceModel model = mean_texture_model(pipe.data(), 64);
  EXPECT_GT(psnr_of(pipe.error(model.static_texture)), 35);
  EXPECT_EQ(model.name, "body");
  EXPECT_FALSE(model.options.view_independent);
}

TEST(MeanTexture, GrazingPixels_CountLess) {
  const PaintedPipe pipe;
  const AppearanceData wrong = pipe.data(true);
  const double weighted =
      pipe.error(mean_texture_model(wrong, 64, {.max_angle = 60}).static_texture);
  const double open = pipe.error(mean_texture_model(wrong, 64, {.max_angle = 90}).static_texture);
  EXPECT_LT(weighted, 0.5 * open);
}

TEST(MeanTexture, AngleWeights_AreSquaredCosines) {
  const PaintedPipe pipe;
  const AppearanceData data = pipe.data();
  const std::vector<std::vector<float>> weights = angle_weights(data, {.max_angle = 90});
  ASSERT_EQ(weights.size(), data.views.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const AppearanceView& view = data.views[i];
    ASSERT_EQ(weights[i].size(), view.u.size());
    for (std::size_t p = 0; p < view.u.size(); p += 37) {
      if (std::abs(view.u[p] - 0.5F) > 0.43F) {
        continue;  // where the pipe ends normals lean to the last faces
      }
      const double angle = std::numbers::pi * (view.u[p] - 0.5);
      const Eigen::Vector3d normal(std::sin(angle), std::cos(angle), 0);
      const Eigen::Vector3d at(0.4 * normal.x(), 0.4 * normal.y(), 0.5 - view.v[p]);
      const Eigen::Vector3d center = data.centers.row(view.camera_idx).transpose();
      const double along = normal.dot((center - at).normalized());
      EXPECT_NEAR(weights[i][p], along * along, 0.02);
    }
  }
}

TEST(MeanTexture, Model_IsReadBackFromItsFile) {
  const PaintedPipe pipe;
  const AppearanceModel model = mean_texture_model(pipe.data(), 32);
  const AppearanceModel again = appearance_model_of(tensors_of(model), texts_of(model));
  EXPECT_EQ(again.static_texture.data, model.static_texture.data);
  EXPECT_EQ(again.camera_ids, model.camera_ids);
  EXPECT_EQ(again.uvs, model.uvs);
}

TEST(MeanTexture, NoView_IsRefused) {
  const PaintedPipe pipe;
  AppearanceData data = pipe.data();
  data.views.clear();
  ATELIER_EXPECT_REFUSED(mean_texture_model(data, 32), DataError, "images of the surface");
}

TEST(MeanTexture, HalfOfTheTextureSeen_IsSaidSo) {
  const PaintedPipe pipe;
  AppearanceData data = pipe.data();
  EXPECT_GT(seen_share(data, 32), 0.9);
  for (AppearanceView& view : data.views) {
    AppearanceView kept = view;
    kept.u.clear();
    kept.v.clear();
    for (std::size_t p = 0; p < view.u.size(); ++p) {
      if (view.v[p] < 0.5F) {
        kept.u.push_back(view.u[p]);
        kept.v.push_back(view.v[p]);
      }
    }
    view = kept;
  }
  EXPECT_NEAR(seen_share(data, 32), 0.5, 0.1);
}

}  // namespace
}  // namespace atelier

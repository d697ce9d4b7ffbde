#include "appearance/prepare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "appearance/painted_scene.h"
#include "core/error.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr int kSide = 48;

/// A sheet and a small lid over it, seen from above by two cameras.
struct Studio {
  Mesh cloth = fixtures::grid(4, 4);
  Mesh lid = fixtures::grid(1, 1);
  DressedSubject subject;
  DrawnSurface surface;
  std::vector<Camera> cameras;
  ByteImage picture{kSide, kSide, 3, 90};

  Studio() {
    cloth.uvs.resize(cloth.vertices.rows(), 2);
    cloth.uvs.col(0) = cloth.vertices.col(0);
    cloth.uvs.col(1) = 1 - cloth.vertices.col(2).array();
    cloth.uv_faces = cloth.faces;
    lid.vertices = 0.4 * lid.vertices;
    lid.vertices.col(1).array() += 0.3;
    subject.names = {"lid", "cloth"};
    subject.faces = {lid.faces, cloth.faces};
    subject.load = [this](int) { return std::vector<Points>{lid.vertices, cloth.vertices}; };
    surface.which = 1;
    surface.label = 5;
    surface.atlas = pack_atlas(cloth);
    for (const char* id : {"a", "b"}) {
      Camera camera;
      camera.id = id;
      camera.width = camera.height = kSide;
      camera.fx = camera.fy = kSide;
      camera.cx = camera.cy = kSide / 2.0;
      camera.camera_from_world_rotation << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      camera.camera_from_world_translation = {-0.5, -0.5, 2};
      cameras.push_back(camera);
    }
  }
  AppearanceData prepared(const ReadPicture& read, std::vector<int> frames = {3, 4}) const {
    PrepareAppearanceOptions options;
    options.occlusion.strata = 3;
    return prepare_appearance(subject, surface, {cameras, frames, read}, options);
  }
};

TEST(PrepareAppearance, PreparedData_HasVisibleSurfaceOnly) {
  const Studio studio;
  const AppearanceData data = studio.prepared([&](std::size_t, int) {
    return TakenPicture{studio.picture, {}};
  });
  EXPECT_EQ(data.name, "cloth");
  ASSERT_TRUE(data.occlusion.has_value());
  EXPECT_EQ(data.occlusion->strata, 3);
  ASSERT_EQ(data.frames.size(), 2U);
  EXPECT_EQ(data.frames[1].frame_id, 4);
  ASSERT_EQ(data.views.size(), 4U);
  EXPECT_EQ(data.views[0].colors.size(), 3 * data.views[0].u.size());
  // Under the lid it is dark, on the far side open; from below nothing is in the way.
  const TransferRows& transfer = data.frames[0].transfer;
  EXPECT_LT(transfer(6, 0), 0.9F);
  EXPECT_GT(transfer(24, 0), 0.95F);
  EXPECT_GT(transfer.col(kTransferTerms).minCoeff(), 0.95F);
  check_appearance_data(data);
}

TEST(PrepareAppearance, CamerasWithoutImages_AreLeftOut) {
  const Studio studio;
  const AppearanceData data = studio.prepared([&](std::size_t camera, int frame_id) {
    return camera == 1 && frame_id == 3 ? TakenPicture() : TakenPicture{studio.picture, {}};
  });
  EXPECT_EQ(data.views.size(), 3U);
}

TEST(PrepareAppearance, LabelImages_ExcludeOtherLabels) {
  const Studio studio;
  ByteImage labels(kSide, kSide, 1, 5);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < 24; ++x) {
      labels.at(x, y) = x < 20 ? 2 : 5;  // hair over a part of it
    }
  }
  const AppearanceData data = studio.prepared([&](std::size_t, int) {
    return TakenPicture{studio.picture, labels};
  });
  for (const int place : data.views[0].pixel) {
    EXPECT_GT(place % kSide, 20) << "next to hair it may be hair";
  }
  EXPECT_GT(data.views[0].pixel.size(), 100U);
}

TEST(PrepareAppearance, LabelsOnePixelOff_ExcludeTheBackground) {
  const Studio studio;
  ByteImage picture(kSide, kSide, 3, 90);
  ByteImage labels(kSide, kSide, 1, 5);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < 24; ++x) {
      for (int c = 0; c < 3; ++c) {
        picture.at(x, y, c) = 250;  // a wall
      }
      labels.at(x, y) = x < 23 ? 0 : 5;
    }
  }
  const AppearanceData data = studio.prepared([&](std::size_t, int) {
    return TakenPicture{picture, labels};
  });
  ASSERT_GT(data.views[0].colors.size(), 300U);
  for (const auto color : data.views[0].colors) {
    EXPECT_EQ(color, 90);
  }
}

TEST(PrepareAppearanceRefused, LabelsWithoutCoherentRegion_AreRefused) {
  const Studio studio;
  ByteImage labels(kSide, kSide, 1, 5);  // five pixels of six agree, and none is far from another
  for (int y = 0; y < kSide; y += 2) {
    for (int x = 1; x < kSide; x += 3) {
      labels.at(x, y) = 0;
    }
  }
  ATELIER_EXPECT_REFUSED(studio.prepared([&](std::size_t, int) {
    return TakenPicture{studio.picture, labels};
  }),
                         DataError, "pixels that show it are left");
}

TEST(PrepareAppearanceRefused, ErosionLeavingNothing_IsRefused) {
  const Studio studio;
  PrepareAppearanceOptions options;
  options.visible.erosion = 32;
  ATELIER_EXPECT_REFUSED(prepare_appearance(studio.subject, studio.surface,
                                            {studio.cameras,
                                             {3, 4},
                                             [&](std::size_t, int) {
                                               return TakenPicture{studio.picture, {}};
                                             }},
                                            options),
                         DataError, "less --visible.erosion");
}

TEST(PrepareAppearanceRefused, ImagesContradictingGeometry_AreRefused) {
  const Studio studio;
  ByteImage labels(kSide, kSide, 1, 1);
  labels.at(24, 24) = 5;
  ATELIER_EXPECT_REFUSED(studio.prepared([&](std::size_t, int) {
    return TakenPicture{studio.picture, labels};
  }),
                         DataError, "label images give it");
}

// A coat that nobody registered covers all but a strip: no contradiction, as the wall would be.
TEST(PrepareAppearance, LabelsOfWhatHides_ContradictNothing) {
  Studio studio;
  const auto labelled = [&](std::uint8_t elsewhere) {
    ByteImage labels(kSide, kSide, 1, elsewhere);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 22; x < 27; ++x) {
        labels.at(x, y) = 5;
      }
    }
    return studio.prepared([&](std::size_t, int) { return TakenPicture{studio.picture, labels}; });
  };
  ATELIER_EXPECT_REFUSED(labelled(3), DataError, "label images give it");
  studio.surface.hidden = true;
  EXPECT_FALSE(labelled(3).views.empty());
  ATELIER_EXPECT_REFUSED(labelled(0), DataError, "label images give it");
}

TEST(PrepareAppearanceRefused, MismatchedImages_AreRefused) {
  Studio studio;
  const auto refused = [&](const TakenPicture& taken, const char* words) {
    ATELIER_EXPECT_REFUSED(studio.prepared([&](std::size_t, int) { return taken; }), DataError,
                           words);
  };
  refused({ByteImage(kSide, 20, 3), {}}, "as calibrated");
  refused({ByteImage(kSide, kSide, 1), {}}, "channels");
  refused({studio.picture, ByteImage(9, 9, 1)}, "label image");
  refused({}, "none at all; expected images of the frames");
  studio.subject.load = [&](int) { return std::vector<Points>{studio.lid.vertices, Points(0, 3)}; };
  refused({studio.picture, {}}, "no cloth");
  studio.surface.which = 7;
  ATELIER_EXPECT_REFUSED(studio.prepared({}), LogicError, "one of the subject's");
}

PaintedScene small_scene() {
  const Studio studio;
  PaintedScene scene;
  scene.layers = {{"lid", "", {0.1F, 0.2F, 0.3F}, studio.lid.faces},
                  {"cloth", "x/model.safetensors", {0.4F, 0.5F, 0.6F}, studio.cloth.faces}};
  scene.cameras = {studio.cameras[0]};
  scene.cameras[0].distortion_model = Distortion::Brown;
  scene.cameras[0].distortion[1] = 0.01;
  scene.frame_ids = {4, 9};
  scene.vertices = {{studio.lid.vertices, studio.cloth.vertices},
                    {Points(0, 3), 2 * studio.cloth.vertices}};
  return scene;
}

TEST(PaintedScene, Archive_RoundTrips) {
  const PaintedScene scene = small_scene();
  const PaintedScene back = painted_scene_of(archive_of(scene));
  EXPECT_EQ(back.frame_ids, scene.frame_ids);
  ASSERT_EQ(back.layers.size(), 2U);
  EXPECT_EQ(back.layers[0].color, scene.layers[0].color);
  EXPECT_EQ(back.layers[1].model, "x/model.safetensors");
  EXPECT_EQ(back.layers[1].faces, scene.layers[1].faces);
  ASSERT_EQ(back.cameras.size(), 1U);
  EXPECT_EQ(back.cameras[0].id, "a");
  EXPECT_EQ(back.cameras[0].distortion, scene.cameras[0].distortion);
  EXPECT_EQ(back.cameras[0].camera_from_world_rotation,
            scene.cameras[0].camera_from_world_rotation);
  EXPECT_EQ(back.vertices[1][0].rows(), 0);
  EXPECT_LT((back.vertices[1][1] - scene.vertices[1][1]).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(PaintedSceneRefused, InconsistentArrays_AreRefused) {
  const Archive good = archive_of(small_scene());
  const auto refused = [&](const std::function<void(Archive&)>& damage, const char* words) {
    Archive archive = good;
    damage(archive);
    ATELIER_EXPECT_REFUSED(painted_scene_of(archive, "x.h5"), DataError, words);
  };
  refused([](Archive& a) { a.numbers.clear(); }, "layers");
  refused([](Archive& a) { a.numbers["layers"] = 1e9; }, "1 to 1000");
  refused([](Archive& a) { a.numbers["layers"] = 3; }, "layers/2");
  refused([](Archive& a) { a.datasets.erase("frames/id"); }, "frames/id");
  refused([](Archive& a) { a.datasets["frames/id"] = tensor_of(std::vector<int>{1}); }, "worn");
  refused([](Archive& a) { a.datasets.erase("layers/1/vertices"); }, "layers/1");
  refused(
      [](Archive& a) {
        a.datasets["layers/0/worn"] = tensor_of(std::vector<int>{1, 1});
      },
      "layers/0/vertices");
  refused(
      [](Archive& a) {
        std::vector<float> bad(a.datasets["layers/0/vertices"].data.size() / 4, std::nanf(""));
        a.datasets["layers/0/vertices"] = tensor_of(bad, a.datasets["layers/0/vertices"].shape);
      },
      "layers/0/vertices");
  refused(
      [](Archive& a) {
        a.datasets["cameras/numbers"] = tensor_of(std::vector<double>(30, -1), {1, 30});
      },
      "size or lens");
  PaintedScene scene = small_scene();
  scene.cameras.clear();
  ATELIER_EXPECT_REFUSED(archive_of(scene), LogicError, "one camera");
}

}  // namespace
}  // namespace atelier

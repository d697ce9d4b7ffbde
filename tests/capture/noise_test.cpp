// Detections, labels, sensors, fabrics: how far from the ground truth, and the same on any thread
// count.

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "capture/atlas.h"
#include "capture/detector.h"
#include "capture/dome.h"
#include "capture/fabric.h"
#include "capture/label_taxonomy.h"
#include "capture/sensor.h"
#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

Camera one_camera() {
  return dome_cameras({.cameras = 2, .pairs = false, .width = 800, .height = 1000}, {1, 1})[0];
}

Points scattered(const KeypointSchema& schema, Random random) {
  Points points(static_cast<Index>(schema.points.size()), 3);
  for (Index i = 0; i < points.rows(); ++i) {
    points.row(i) << uniform(random, -0.3, 0.3), uniform(random, 0.3, 1.6),
        uniform(random, -0.2, 0.2);
  }
  return points;
}

TEST(Detector, PerfectDetector_GivesExactProjection) {
  const Camera camera = one_camera();
  const KeypointSchema& schema = body_25_schema();
  const Points points = scattered(schema, {5, 5});
  const Keypoints2d found = detected_keypoints(
      camera, schema, points, std::vector<KeypointSight>(25), {.perfect = true}, {1, 1});
  for (Index i = 0; i < 25; ++i) {
    const auto pixel = project(camera, points.row(i).transpose());
    EXPECT_EQ(found(i, 0), pixel->x());
    EXPECT_EQ(found(i, 1), pixel->y());
    EXPECT_EQ(found(i, 2), 1);
  }
}

TEST(Detector, NoiseDropoutAndConfidence_HaveRequestedSize) {
  const Camera camera = one_camera();
  const KeypointSchema& schema = coco_wholebody_schema();
  const DetectorOptions options{.dropout = 0.1, .swaps = 0, .outliers = 0};
  double sum = 0;
  int found_count = 0;
  int count = 0;
  double sharp = 0;
  double blurred = 0;
  int sharp_count = 0;
  int blurred_count = 0;
  for (std::uint64_t image = 0; image < 60; ++image) {
    const Points points = scattered(schema, {9, image});
    const Keypoints2d found = detected_keypoints(
        camera, schema, points, std::vector<KeypointSight>(133), options, {2, image});
    for (Index i = 0; i < 133; ++i) {
      ++count;
      if (found(i, 2) == 0) {
        continue;
      }
      const auto pixel = project(camera, points.row(i).transpose());
      const double squared = (found.row(i).head<2>().transpose() - *pixel).squaredNorm();
      sum += squared / 2;
      ++found_count;
      (found(i, 2) > 0.88 ? sharp : blurred) += squared;
      ++(found(i, 2) > 0.88 ? sharp_count : blurred_count);
    }
  }
  EXPECT_NEAR(std::sqrt(sum / found_count), 3, 0.25);
  EXPECT_NEAR(1 - static_cast<double>(found_count) / count, 0.1, 0.02);
  // Confidence means something: what is confident is nearer to the truth.
  EXPECT_LT(2 * sharp / sharp_count, blurred / blurred_count);
}

TEST(Detector, OutliersSwapsAndClothBias_HaveRequestedEffect) {
  const Camera camera = one_camera();
  const KeypointSchema& schema = body_25_schema();
  const Points points = scattered(schema, {9, 1});
  const std::vector<KeypointSight> plain(25);
  const DetectorOptions swapped{.noise = 0, .dropout = 0, .swaps = 1, .outliers = 0};
  const Keypoints2d found = detected_keypoints(camera, schema, points, plain, swapped, {1, 1});
  const int left = find_keypoint(schema, "left_knee");
  const int right = find_keypoint(schema, "right_knee");
  EXPECT_NEAR(found(left, 0), project(camera, points.row(right).transpose())->x(), 1e-9);

  std::vector<KeypointSight> covered(25);
  for (KeypointSight& sight : covered) {
    sight.covered = true;
    sight.under_cloth = 1;
    sight.centre_x = 400;
  }
  const Keypoints2d drawn =
      detected_keypoints(camera, schema, points, covered,
                         {.noise = 0, .dropout = 0, .swaps = 0, .outliers = 0}, {1, 1});
  const double x = project(camera, points.row(0).transpose())->x();
  EXPECT_NEAR(drawn(0, 0), x + 0.35 * (400 - x), 1e-9);

  int far = 0;
  for (std::uint64_t image = 0; image < 200; ++image) {
    const Keypoints2d wild =
        detected_keypoints(camera, schema, points, plain,
                           {.noise = 1, .dropout = 0, .swaps = 0, .outliers = 0.1}, {3, image});
    for (Index i = 0; i < 25; ++i) {
      const auto pixel = project(camera, points.row(i).transpose());
      far += wild(i, 2) == 0 || (wild.row(i).head<2>().transpose() - *pixel).norm() > 20 ? 1 : 0;
    }
  }
  EXPECT_NEAR(far / 5000.0, 0.1, 0.025);
}

TEST(Detector, MismatchedLists_AreRefused) {
  ATELIER_EXPECT_REFUSED(
      detected_keypoints(one_camera(), body_25_schema(), Points::Zero(3, 3), {}, {}, {}),
      LogicError, "one point and one sight");
}

ByteImage person_labels() {
  ByteImage labels(200, 250, 1);
  for (int y = 40; y < 220; ++y) {
    for (int x = 70; x < 130; ++x) {
      labels.at(x, y) = static_cast<std::uint8_t>(y < 90 ? Label::Skin : Label::Dress);
    }
  }
  return labels;
}

TEST(LabelNoise, LabelErrors_OccurOnlyAtBorders) {
  const ByteImage truth = person_labels();
  EXPECT_EQ(detected_labels(truth, {.perfect = true}, {1, 1}).data, truth.data);
  const ByteImage found = detected_labels(truth, {}, {1, 1});
  EXPECT_EQ(found.data, detected_labels(truth, {}, {1, 1}).data);
  EXPECT_NE(found.data, detected_labels(truth, {}, {2, 1}).data);
  int wrong = 0;
  int deep = 0;
  for (int y = 0; y < 250; ++y) {
    for (int x = 0; x < 200; ++x) {
      wrong += found.at(x, y) != truth.at(x, y) ? 1 : 0;
      const bool inside = x > 80 && x < 120 && (y > 100 && y < 210);
      const bool outside = x < 58 || x > 142 || y < 28 || y > 232;
      deep += (inside || outside) && found.at(x, y) != truth.at(x, y) ? 1 : 0;
    }
  }
  EXPECT_GT(wrong, 50);
  EXPECT_LT(wrong, 1500);
  EXPECT_EQ(deep, 0);
}

TEST(Sensor, ShotNoise_GrowsAsRootOfLight) {
  const SensorOptions options{.shot_noise = 0.02, .read_noise = 0};
  for (const float value : {0.25F, 1.0F}) {
    const Image light(64, 64, 3, value);
    const Image seen = noisy(light, options, 1, 2);
    double sum = 0;
    for (const float v : seen.data) {
      sum += std::pow(v - value, 2);
    }
    EXPECT_NEAR(std::sqrt(sum / static_cast<double>(seen.data.size())), 0.02 * std::sqrt(value),
                0.001);
  }
  const Image bright = exposed(Image(2, 2, 3, 0.5F), {1, 2, 3}, {.exposure = 2});
  EXPECT_FLOAT_EQ(bright.at(1, 1, 2), 3.0F);
  ATELIER_EXPECT_REFUSED(noisy(Image(2, 2, 1), {}, 1, 1), LogicError, "three channels");
}

TEST(Sensor, AnyThreadCount_GivesTheSameImages) {
  const Image light(300, 400, 3, 0.5F);
  const int before = thread_count();
  set_thread_count(1);
  const Image one = noisy(light, {}, 1, 2);
  const Image cloth_one = fabric_image(0.5, {.resolution = 128}, 3);
  set_thread_count(2);
  EXPECT_EQ(one.data, noisy(light, {}, 1, 2).data);
  EXPECT_EQ(cloth_one.data, fabric_image(0.5, {.resolution = 128}, 3).data);
  set_thread_count(before);
}

TEST(Fabric, CodedCells_AreUniqueByNeighborhood) {
  // Cells of 8 texels: the colour at each cell's middle.
  const FabricOptions options{.kind = FabricKind::Coded, .resolution = 512, .cell = 1.0 / 64};
  const Image cloth = fabric_image(1, options, 5);
  const auto color = [&](int i, int j) {
    int best = 0;
    for (int c = 0; c < 3; ++c) {
      best = best * 16 + static_cast<int>(15 * cloth.at(8 * i + 4, 8 * j + 4, c));
    }
    return best;
  };
  std::set<std::vector<int>> seen;
  int repeats = 0;
  for (int i = 1; i < 63; ++i) {
    for (int j = 1; j < 63; ++j) {
      std::vector<int> code;
      for (int k = 0; k < 9; ++k) {
        code.push_back(color(i + k % 3 - 1, j + k / 3 - 1));
      }
      repeats += seen.insert(code).second ? 0 : 1;
    }
  }
  EXPECT_LE(repeats, 2);
}

TEST(Fabric, Print_IsTheSameOnAllGarments) {
  const Image print = fabric_image(0.2, {.kind = FabricKind::Print, .resolution = 64}, 3);
  const Image all = fabric_image(0.2, {.kind = FabricKind::AllPrint, .resolution = 64}, 3);
  EXPECT_EQ(print.data, all.data);
}

TEST(Fabric, FabricKinds_IncreaseInContrast) {
  const auto contrast = [](FabricKind kind) {
    const Image cloth = fabric_image(0.4, {.kind = kind, .resolution = 256}, 1);
    double sum = 0;
    double squares = 0;
    for (const float v : cloth.data) {
      sum += v;
      squares += static_cast<double>(v) * v;
    }
    const double mean = sum / static_cast<double>(cloth.data.size());
    return squares / static_cast<double>(cloth.data.size()) - mean * mean;
  };
  EXPECT_LT(contrast(FabricKind::Plain), contrast(FabricKind::Woven));
  EXPECT_LT(contrast(FabricKind::Woven), contrast(FabricKind::Print));
  EXPECT_LT(contrast(FabricKind::Print), contrast(FabricKind::Coded));
  ATELIER_EXPECT_REFUSED(fabric_image(0, {}, 1), LogicError, "size");
  ATELIER_EXPECT_REFUSED(fabric_image(1, {.resolution = 1}, 1), LogicError, "resolution");
}

TEST(Atlas, Texels_MapToSurfacePoints) {
  Mesh square;
  square.vertices.resize(4, 3);
  square.vertices << 0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0;
  square.faces.resize(2, 3);
  square.faces << 0, 1, 2, 0, 2, 3;
  square.uvs.resize(4, 2);
  square.uvs << 0.25, 0.25, 0.75, 0.25, 0.75, 0.75, 0.25, 0.75;
  square.uv_faces = square.faces;
  const Atlas atlas = mesh_atlas(square, 64);
  EXPECT_NEAR(atlas.position.at(32, 32, 0), 2 * (32.5 / 64 - 0.25) / 0.5, 1e-5);
  EXPECT_NEAR(atlas.position.at(32, 20, 1), 2 * (1 - 20.5 / 64 - 0.25) / 0.5, 1e-5);
  EXPECT_EQ(atlas.covered.at(32, 32), 1);
  EXPECT_EQ(atlas.covered.at(2, 2), 0);
  EXPECT_GT(atlas.position.at(12, 32, 1), 0);  // grown outward
  square.uvs.resize(0, 2);
  ATELIER_EXPECT_REFUSED(mesh_atlas(square, 64), LogicError, "texture coordinates");
}

}  // namespace
}  // namespace atelier

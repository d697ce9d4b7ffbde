// The capture's own picture beside trials of materials: the same camera, cut alike.
#include "pipeline/cloth/material_grid.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "capture/dome.h"
#include "capture/stereo/undistort.h"
#include "core/atomic_file.h"
#include "core/io/image_file.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

namespace fs = std::filesystem;

constexpr int kFrame = 7;

/// An open tube round the vertical axis, faces outwards.
Mesh round_tube(double radius, double low, double high) {
  constexpr int kAround = 24;
  Mesh mesh;
  mesh.vertices.resize(2 * kAround, 3);
  mesh.faces.resize(2 * kAround, 3);
  for (int i = 0; i < kAround; ++i) {
    const double angle = 2 * std::numbers::pi * i / kAround;
    mesh.vertices.row(2 * i) << radius * std::sin(angle), low, radius * std::cos(angle);
    mesh.vertices.row(2 * i + 1) << radius * std::sin(angle), high, radius * std::cos(angle);
    const int a = 2 * i;
    const int b = 2 * ((i + 1) % kAround);
    mesh.faces.row(2 * i) << a, b, b + 1;
    mesh.faces.row(2 * i + 1) << a, b + 1, a + 1;
  }
  return mesh;
}

/// A skirt on a trunk, seen by four cameras whose pixels tell their place.
class MaterialGrid : public ::testing::Test {
 protected:
  MaterialGrid() {
    const Mesh skirt = round_tube(0.3, 0.5, 1.0);
    const Mesh trunk = round_tube(0.15, 0, 1.7);
    TrialGarment garment;
    garment.worn.garment.mesh = skirt;
    garment.targets = {skirt.vertices};
    trials_.garments.push_back(garment);
    trials_.body_faces = trunk.faces;
    trials_.bodies = {trunk.vertices};
    trials_.steps = {0};
    trials_.frame_ids = {kFrame};
    dataset_.root = folder_.path();
    dataset_.cameras = dome_cameras(
        {.cameras = 4, .pairs = false, .width = 120, .height = 120, .gain = 0}, {1, 1});
    dataset_.frames.resize(dataset_.cameras.size());
    for (std::size_t c = 0; c < dataset_.cameras.size(); ++c) {
      ByteImage image(120, 120, 3);
      for (int y = 0; y < 120; ++y) {
        for (int x = 0; x < 120; ++x) {
          image.at(x, y, 0) = static_cast<std::uint8_t>(2 * x);
          image.at(x, y, 1) = static_cast<std::uint8_t>(2 * y);
          image.at(x, y, 2) = static_cast<std::uint8_t>(60 * c);
        }
      }
      const fs::path file = folder_ / ("camera" + std::to_string(c) + ".png");
      write_image(file, image);
      dataset_.frames[c].images.set(kFrame, {file, "", -1});
    }
  }
  fixtures::TemporaryDirectory folder_;
  Dataset dataset_;
  Trials trials_;
};

/// The camera that took a picture, by its blue.
std::size_t camera_of(const TakenGarments& taken, const Dataset& dataset) {
  for (std::size_t c = 0; c < dataset.cameras.size(); ++c) {
    if (taken.caption.find("camera " + dataset.cameras[c].id + "\n") != std::string::npos) {
      return c;
    }
  }
  ADD_FAILURE() << taken.caption;
  return 0;
}

TEST_F(MaterialGrid, TakenPicture_IsCutAsItsCameraIs) {
  const auto taken = taken_garments(dataset_, trials_);
  ASSERT_TRUE(taken.has_value());
  EXPECT_EQ(taken->picture.width, taken->camera.width);
  EXPECT_EQ(taken->picture.height, taken->camera.height);
  EXPECT_NE(taken->caption.find("frame 7"), std::string::npos);
  const Camera straight = without_distortion(dataset_.cameras[camera_of(*taken, dataset_)]);
  const Points& skirt = trials_.garments[0].targets.back();
  for (Index v = 0; v < skirt.rows(); ++v) {
    const Eigen::Vector3d point = skirt.row(v).transpose();
    const Eigen::Vector2d here = *project(taken->camera, point);
    const Eigen::Vector2d there = *project(straight, point);
    ASSERT_GT(here.x(), 0);
    ASSERT_GT(here.y(), 0);
    ASSERT_LT(here.x(), taken->camera.width);
    ASSERT_LT(here.y(), taken->camera.height);
    const auto byte = [&](int channel) {
      const float linear =
          taken->picture.at(static_cast<int>(here.x()), static_cast<int>(here.y()), channel);
      return 255 *
             (linear <= 0.0031308F ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055);
    };
    // The distortion of the dome's lenses is a pixel or two here.
    EXPECT_NEAR(byte(0) / 2, there.x(), 3) << v;
    EXPECT_NEAR(byte(1) / 2, there.y(), 3) << v;
  }
}

TEST_F(MaterialGrid, HeldOutCamera_IsNotOpened) {
  const std::size_t first = camera_of(*taken_garments(dataset_, trials_), dataset_);
  dataset_.info.held_out_cameras = {dataset_.cameras[first].id};
  fs::remove(dataset_.frames[first].images.find(kFrame)->file);
  const auto other = taken_garments(dataset_, trials_);
  ASSERT_TRUE(other.has_value());
  EXPECT_NE(camera_of(*other, dataset_), first);
}

TEST_F(MaterialGrid, NoPictureOfTheFrame_GivesNothing) {
  for (CameraFrames& frames : dataset_.frames) {
    frames.images.clear();
  }
  EXPECT_FALSE(taken_garments(dataset_, trials_).has_value());
  dataset_.calibrated = false;
  EXPECT_FALSE(taken_garments(dataset_, trials_).has_value());
}

TEST_F(MaterialGrid, GridBesideThePicture_HasOneColumnMore) {
  std::vector<std::vector<Stiffness>> scenes;
  std::vector<SceneResult> results;
  for (const double stretch : {100.0, 1000.0}) {
    for (int row = 0; row < 2; ++row) {
      scenes.push_back({{stretch, 1e-5}});
      results.push_back({{0.001}, trials_.garments[0].targets.back()});
    }
  }
  results[3].end.resize(0, 3);  // it broke
  const auto taken = taken_garments(dataset_, trials_);
  ASSERT_TRUE(taken.has_value());
  const Image beside = material_grid(trials_, scenes, results, 2, taken);
  EXPECT_GT(beside.width, 3 * taken->camera.width);
  EXPECT_LT(beside.width, 4 * taken->camera.width);
  const Image alone = material_grid(trials_, scenes, results, 2, std::nullopt);
  EXPECT_GT(alone.width, 2 * 200);
  EXPECT_LT(alone.width, 3 * 200);
}

}  // namespace
}  // namespace atelier

// Every layout, written with cameras of every turn and of huge numbers and read again: turns
// project as before, huge numbers are refused or judged, and nothing breaks.

#include <list>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>

#include "capture/camera_conventions.h"
#include "capture/layouts/open_dataset.h"
#include "capture/layouts/write_layout.h"
#include "capture/validate.h"
#include "core/error.h"
#include "tests/capture/small_capture.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

/// A camera of the small capture, turned about one of its own axes where it stands.
Camera turned_about(int axis, int degrees, const std::string& id) {
  Camera camera = SmallCapture().cameras[0];
  camera.id = id;
  camera.distortion_model = Distortion::None;  // which some layouts have no place for
  camera.distortion = {};
  const Eigen::Vector3d turn = degrees * std::numbers::pi / 180 * Eigen::Vector3d::Unit(axis);
  const Eigen::Vector3d centre = camera_center(camera);
  camera.camera_from_world_rotation = rotation_of_vector(turn) * camera.camera_from_world_rotation;
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
  return camera;
}

/// Multiples of 45 degrees about each axis.
std::vector<Camera> cameras_of_every_turn() {
  std::vector<Camera> cameras;
  for (int axis = 0; axis < 3; ++axis) {
    for (int degrees = 0; degrees < 360; degrees += 45) {
      const std::string number = std::to_string(100 + cameras.size());
      cameras.push_back(turned_about(axis, degrees, number));
    }
  }
  return cameras;
}

class HostileLayout : public ::testing::TestWithParam<std::string> {
 protected:
  /// Cameras in the layout and back, or nothing where it refuses them.
  std::optional<Dataset> there_and_back(const std::vector<Camera>& cameras) {
    const TemporaryDirectory* const folder = &folders_.emplace_back();
    SmallCapture small;
    small.frames = {0, 1};
    small.cameras.assign(cameras.size(), small.cameras[0]);
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      small.cameras[c].id = cameras[c].id;
    }
    write_small_capture(folder->path() / "capture", small);
    Dataset dataset = open_dataset(folder->path() / "capture");
    dataset.cameras = cameras;
    try {
      const LayoutReport report = write_layout(dataset, GetParam(), folder->path() / "out");
      return open_dataset(report.folders.front());
    } catch (const DataError&) {
      return std::nullopt;
    }
  }
  std::list<TemporaryDirectory> folders_;
};

INSTANTIATE_TEST_SUITE_P(Layouts, HostileLayout, ::testing::ValuesIn(layout_names()),
                         [](const auto& layout) { return layout.param; });

TEST_P(HostileLayout, CamerasOfEveryTurn_ProjectAsBefore) {
  const std::vector<Camera> cameras = cameras_of_every_turn();
  const std::optional<Dataset> dataset = there_and_back(cameras);
  ASSERT_TRUE(dataset);
  ASSERT_EQ(dataset->cameras.size(), cameras.size());
  if (!dataset->calibrated) {
    GTEST_SKIP() << "images alone have no calibration";
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Index named = camera_index(*dataset, cameras[c].id);  // some layouts count cameras
    const Camera& read = dataset->cameras[named < 0 ? c : static_cast<std::size_t>(named)];
    const Eigen::Vector3d centre = camera_center(cameras[c]);
    const Eigen::Matrix3d world_from_camera = cameras[c].camera_from_world_rotation.transpose();
    for (const Eigen::Vector3d& off :
         {Eigen::Vector3d(0, 0, 2), {0.3, -0.2, 1.5}, {-0.4, 0.5, 3}, {0, 0, -1}}) {
      const Eigen::Vector3d point = centre + world_from_camera * off;
      const auto expected = project(cameras[c], point);
      const auto found = project(read, point);
      ASSERT_EQ(expected.has_value(), found.has_value()) << cameras[c].id;
      if (expected) {
        EXPECT_LT((*expected - *found).norm(), 1e-6) << cameras[c].id;
      }
    }
  }
  FrameReader reader(*dataset);
  EXPECT_NO_THROW(validate(reader));
}

TEST_P(HostileLayout, CamerasOfHugeNumbers_AreRefusedOrJudged) {
  const std::vector<Camera> good = SmallCapture().cameras;
  for (const double huge : {1e9, 1e12, 1e300}) {
    for (int kind = 0; kind < 6; ++kind) {
      for (const bool all : {false, true}) {
        std::vector<Camera> cameras = good;
        for (std::size_t c = 0; c < cameras.size(); ++c) {
          Camera& camera = cameras[c];
          if (c > 0 && !all) {
            break;
          }
          camera.fx = kind == 0 ? huge : camera.fx;
          camera.fy = kind == 0 ? huge : camera.fy;
          camera.cx = kind == 1 ? -huge : camera.cx;
          camera.cy = kind == 2 ? huge : camera.cy;
          if (kind == 3 || kind == 4) {
            camera.distortion_model = kind == 3 ? Distortion::Brown : Distortion::Fisheye;
            camera.distortion = {huge, -huge, huge, huge};
          }
          if (kind == 5) {
            camera.camera_from_world_translation = {huge, -huge, huge};
          }
        }
        if (auto dataset = there_and_back(cameras)) {
          FrameReader reader(std::move(*dataset));
          EXPECT_NO_THROW(validate(reader)) << huge << " " << kind;
        }
        folders_.clear();
      }
    }
  }
}

}  // namespace
}  // namespace atelier::fixtures

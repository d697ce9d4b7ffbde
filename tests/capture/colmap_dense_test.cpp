// Depth maps in COLMAP's files: round trips, and what is refused.

#include "capture/layouts/colmap_dense.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/layouts/colmap.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// A camera that is turned, three pixels by two.
DepthMap small_map() {
  DepthMap map;
  map.camera.id = "a";
  map.camera.width = 3;
  map.camera.height = 2;
  map.camera.fx = map.camera.fy = 4;
  map.camera.cx = 1.5;
  map.camera.cy = 1;
  map.camera.camera_from_world_rotation =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  map.depth = Image(3, 2, 1);
  map.normal = Image(3, 2, 3);
  map.confidence = Image(3, 2, 1);
  for (int i = 0; i < 6; ++i) {
    const auto p = static_cast<std::size_t>(i);
    map.depth.data[p] = 0.5F * static_cast<float>(i);
    map.confidence.data[p] = 0.1F * static_cast<float>(i);
    const Eigen::Vector3f n = Eigen::Vector3f(1, static_cast<float>(i), -2).normalized();
    std::memcpy(&map.normal.data[3 * p], n.data(), sizeof(float) * 3);
  }
  return map;
}

TEST(ColmapDense, Matrix_IsStoredChannelByChannel) {
  Image image(2, 1, 3);
  image.data = {1, 2, 3, 4, 5, 6};
  const std::string text = colmap_matrix(image);
  EXPECT_EQ(text.substr(0, 6), "2&1&3&");
  std::array<float, 6> values{};
  std::memcpy(values.data(), text.data() + 6, sizeof(values));
  EXPECT_THAT(values, ::testing::ElementsAre(1, 4, 2, 5, 3, 6));
  EXPECT_EQ(parse_colmap_matrix(bytes_of(text)).data, image.data);
}

TEST(ColmapDense, DepthMap_RoundTripsInWorldFrame) {
  const TemporaryDirectory folder;
  const DepthMap map = small_map();
  write_dense_workspace(folder.path(), {map.camera}, {Image(3, 2, 3, 0.5F)}, Points(0, 3));
  EXPECT_FALSE(has_depth_map(folder.path(), map.camera));
  write_depth_map(folder.path(), map);
  EXPECT_TRUE(has_depth_map(folder.path(), map.camera));
  const DepthMap back = read_depth_map(folder.path(), map.camera);
  EXPECT_EQ(back.depth.data, map.depth.data);
  EXPECT_EQ(back.confidence.data, map.confidence.data);
  for (std::size_t i = 0; i < map.normal.data.size(); ++i) {
    EXPECT_NEAR(back.normal.data[i], map.normal.data[i], 1e-6F);
  }
}

TEST(ColmapDense, CamerasAndPoints_AreWrittenAsColmapExpects) {
  const TemporaryDirectory folder;
  const DepthMap map = small_map();
  Points places(1, 3);
  places.row(0) =
      (map.camera.camera_from_world_rotation.transpose() * Eigen::Vector3d(0, 0, 2)).transpose();
  write_dense_workspace(folder.path(), {map.camera}, {Image(3, 2, 3, 0.5F)}, places);
  const auto read = [&](const char* name) {
    return read_file_text(folder.path() / "sparse" / name, 1 << 20);
  };
  const auto cameras = parse_colmap_cameras_text(read("cameras.txt"));
  EXPECT_EQ(cameras.at(1).fx, 4);
  const auto images = parse_colmap_images_text(read("images.txt"));
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images[0].name, "a.png");
  EXPECT_LT((images[0].camera_from_world_rotation - map.camera.camera_from_world_rotation).norm(),
            1e-12);
  EXPECT_THAT(read("points3D.txt"), ::testing::HasSubstr(" 1 0\n"));  // image 1, its point 0
}

TEST(ColmapDense, MalformedMatrix_IsRefused) {
  const std::string good = colmap_matrix(small_map().depth);
  const auto refused = [](const std::string& text, const char* words) {
    ATELIER_EXPECT_REFUSED(parse_colmap_matrix(bytes_of(text), "map.bin"), DataError, words);
  };
  refused("", "width&height&channels&");
  refused("3&2&", "width&height&channels&");
  refused("3x2&1&", "width&height&channels&");
  refused("-3&2&1&", "width&height&channels&");
  refused("9999999&2&1&", "width&height&channels&");
  refused("0&2&1&", "1 or 3 channels");
  refused("3&2&2&" + std::string(48, '\0'), "1 or 3 channels");
  refused("16000&16000&1&", "at most");
  refused(good.substr(0, good.size() - 1), "23 bytes");
  refused(good + "x", "25 bytes");
}

TEST(ColmapDense, ImplausibleDepthMap_IsRefused) {
  const TemporaryDirectory folder;
  const DepthMap map = small_map();
  write_dense_workspace(folder.path(), {map.camera}, {Image(3, 2, 3, 0.5F)}, Points(0, 3));
  ATELIER_EXPECT_REFUSED(read_depth_map(folder.path(), map.camera), DataError, "no such map");
  const auto with = [&](const char* kind, float value) {
    write_depth_map(folder.path(), map);
    Image bad(3, 2, std::string(kind) == "normal_maps" ? 3 : 1);
    bad.data[1] = value;
    std::ofstream(folder.path() / "stereo" / kind / "a.png.geometric.bin", std::ios::binary)
        << colmap_matrix(bad);
  };
  with("depth_maps", -1);
  ATELIER_EXPECT_REFUSED(read_depth_map(folder.path(), map.camera), DataError, "0 or metres");
  with("depth_maps", std::numeric_limits<float>::quiet_NaN());
  ATELIER_EXPECT_REFUSED(read_depth_map(folder.path(), map.camera), DataError, "0 or metres");
  with("normal_maps", 2);
  ATELIER_EXPECT_REFUSED(read_depth_map(folder.path(), map.camera), DataError, "unit normals");
  with("confidence_maps", 1.5F);
  ATELIER_EXPECT_REFUSED(read_depth_map(folder.path(), map.camera), DataError, "0 to 1");
  write_depth_map(folder.path(), map);
  Camera larger = map.camera;
  larger.width = 4;
  ATELIER_EXPECT_REFUSED(read_depth_map(folder.path(), larger), DataError, "4 x 2 x 1");
}

}  // namespace
}  // namespace atelier::fixtures

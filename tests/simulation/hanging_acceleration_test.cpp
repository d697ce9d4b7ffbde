#include "simulation/material/hanging_acceleration.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace atelier {
namespace {

constexpr double kFps = 10;

/// A sheet 20 cm over a small ball, moved by `at(frame)` along x.
template <class At>
Sequence moving(const At& at, std::vector<int> frame_ids, double height = 0.2) {
  std::vector<Mesh> meshes;
  for (const int id : frame_ids) {
    Mesh mesh = fixtures::grid(6, 6);
    mesh.vertices.rowwise() += Eigen::RowVector3d(at(id), height, 0);
    meshes.push_back(std::move(mesh));
  }
  return sequence_of(std::move(meshes), kFps, std::move(frame_ids));
}

Mesh ball() {
  Mesh mesh = fixtures::sphere(2);
  mesh.vertices *= 0.05;
  return mesh;
}

std::optional<double> found(const Sequence& sequence, int frame_id) {
  const Mesh body = ball();
  return hanging_acceleration(sequence, frame_id, body.vertices, body.faces);
}

TEST(HangingAcceleration, Acceleration_IsThatOfTheMotion) {
  const auto thrown = [](int id) { return 0.5 * 6.0 * (id / kFps) * (id / kFps); };
  const auto even = [](int id) { return 0.7 * id / kFps; };
  EXPECT_NEAR(found(moving(thrown, {4, 5, 6, 7}), 5).value(), 6, 1e-9);
  EXPECT_NEAR(found(moving(even, {4, 5, 6, 7}), 6).value(), 0, 1e-9);
  EXPECT_GT(found(moving(thrown, {4, 5, 6}), 5).value(), kInMotion);
}

TEST(HangingAcceleration, EndsAndGaps_HaveUnknownAcceleration) {
  const auto still = [](int) { return 0.0; };
  const Sequence sequence = moving(still, {3, 4, 5, 7, 8});
  EXPECT_FALSE(found(sequence, 3));
  EXPECT_TRUE(found(sequence, 4));
  EXPECT_FALSE(found(sequence, 5)) << "frame 6 is missing";
  EXPECT_FALSE(found(sequence, 6));
  EXPECT_FALSE(found(sequence, 8));
}

TEST(HangingAcceleration, ClothLyingOnTheBody_HasUnknownAcceleration) {
  const auto still = [](int) { return 0.0; };
  const Sequence sequence = moving(still, {0, 1, 2}, 0.01);
  Mesh floor = fixtures::grid(1, 1);
  floor.vertices *= 4;
  floor.vertices.rowwise() -= Eigen::RowVector3d(1, 0, 1);
  EXPECT_FALSE(hanging_acceleration(sequence, 1, floor.vertices, floor.faces));
}

}  // namespace
}  // namespace atelier

#include "capture/surface/surface_error.h"

#include <Eigen/Geometry>

#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier::fixtures {
namespace {

/// A square metre at height z, facing up.
Mesh square(double z) {
  Mesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << -0.5, -0.5, z, 0.5, -0.5, z, 0.5, 0.5, z, -0.5, 0.5, z;
  mesh.faces.resize(2, 3);
  mesh.faces << 0, 1, 2, 0, 2, 3;
  return mesh;
}

Camera above(double x, double height) {
  Camera camera;
  camera.width = camera.height = 400;
  camera.fx = camera.fy = 300;
  camera.cx = camera.cy = 200;
  const Eigen::Vector3d centre(x, 0, height);
  const Eigen::Vector3d z = -centre.normalized();
  const Eigen::Vector3d right = Eigen::Vector3d(0, 1, 0).cross(z).normalized();
  camera.camera_from_world_rotation << right.transpose(), z.cross(right).transpose(), z.transpose();
  camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
  return camera;
}

TEST(SeenSurface, SurfaceSeenByTwoCameras_CountsAndByOneDoesNot) {
  const SurfaceSamples both = seen_surface(square(0), {above(0.3, 2), above(-0.3, 2)}, 0.02);
  EXPECT_NEAR(both.area, 1, 1e-9);
  EXPECT_NEAR(both.seen_area, 1, 1e-9);
  EXPECT_NEAR(static_cast<double>(both.points.rows()), 2500, 50);
  EXPECT_EQ(seen_surface(square(0), {above(0, 2)}, 0.02).points.rows(), 0);
}

TEST(SeenSurface, BackFacesAndOccludedSurface_AreNotSeen) {
  EXPECT_EQ(seen_surface(square(0), {above(0.3, -2), above(-0.3, -2)}, 0.02).points.rows(), 0);
  Mesh two = square(0);
  const Mesh lid = square(0.5);
  two.vertices.conservativeResize(8, 3);
  two.vertices.bottomRows(4) = lid.vertices;
  two.faces.conservativeResize(4, 3);
  two.faces.bottomRows(2) = lid.faces.array() + 4;
  const SurfaceSamples seen = seen_surface(two, {above(0.1, 4), above(-0.1, 4)}, 0.02);
  EXPECT_NEAR(seen.seen_area, 1, 0.1);
  EXPECT_GT(seen.points.col(2).minCoeff(), -1e-9);
}

TEST(SurfaceErrorOf, ParallelScan_HasItsDistanceAsError) {
  const Mesh truth = square(0);
  const SurfaceSamples seen = seen_surface(truth, {above(0.3, 2), above(-0.3, 2)}, 0.02);
  const SurfaceError error = surface_error(square(0.003), truth, seen);
  EXPECT_NEAR(error.chamfer, 0.003, 1e-9);
  EXPECT_EQ(error.completeness, 1);
  EXPECT_EQ(error.floating, 0);
  EXPECT_EQ(surface_error(square(0.006), truth, seen).completeness, 0);
  EXPECT_EQ(surface_error(square(0.03), truth, seen).floating, 1);
}

TEST(SurfaceErrorOf, HalfAScan_IsHalfComplete) {
  const Mesh truth = square(0);
  Mesh half = square(0);
  half.faces.conservativeResize(1, 3);
  const SurfaceSamples seen = seen_surface(truth, {above(0.3, 2), above(-0.3, 2)}, 0.01);
  const SurfaceError error = surface_error(half, truth, seen);
  EXPECT_NEAR(error.completeness, 0.5, 0.02);
  EXPECT_LT(error.accuracy, 1e-9);
  EXPECT_GT(error.from_truth, 0.05);
}

TEST(SurfaceErrorOf, Labels_AreComparedOverTheirUnion) {
  Mesh truth = square(0);
  truth.labels = {3, 3, 3, 3};
  Mesh scan = square(0);
  scan.labels = {3, 3, 3, 3};
  const SurfaceSamples seen = seen_surface(truth, {above(0.3, 2), above(-0.3, 2)}, 0.02);
  EXPECT_EQ(surface_error(scan, truth, seen).label_iou, 1);
  scan.labels = {4, 4, 4, 4};
  EXPECT_EQ(surface_error(scan, truth, seen).label_iou, 0);
}

TEST(SurfaceErrorOf, EmptyScanOrUnseenGroundTruth_IsRefused) {
  const Mesh truth = square(0);
  const SurfaceSamples seen = seen_surface(truth, {above(0.3, 2), above(-0.3, 2)}, 0.02);
  Mesh empty = square(0);
  empty.faces.resize(0, 3);
  EXPECT_THROW(surface_error(empty, truth, seen), DataError);
  EXPECT_THROW(surface_error(square(0), truth, SurfaceSamples{}), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures

#include "core/raster.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/tree.h"
#include "tests/support/devices.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::mesh_of;

class RasterOnDevice : public fixtures::DeviceTest {};
ATELIER_ON_EVERY_DEVICE(RasterOnDevice);

/// A camera at the origin whose pixels are world coordinates of the plane z = 1.
Camera flat_camera(int width, int height) {
  Camera camera;
  camera.id = "flat";
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 1;
  return camera;
}

/// A camera `distance` metres in front of the origin, looking at it.
Camera looking_camera(int width, int height, double distance) {
  Camera camera;
  camera.id = "looking";
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 1.2 * width;
  camera.cx = 0.47 * width;
  camera.cy = 0.52 * height;
  camera.camera_from_world_rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;  // y down, looking along -z
  camera.camera_from_world_translation = {0, 0, distance};
  return camera;
}

int covered_pixels(const Raster& raster) {
  return static_cast<int>(std::count_if(raster.face.data.begin(), raster.face.data.end(),
                                        [](int face) { return face >= 0; }));
}

bool same(const Raster& a, const Raster& b) {
  return a.face.data == b.face.data && a.barycentric.data == b.barycentric.data &&
         a.depth.data == b.depth.data;
}

TEST_P(RasterOnDevice, Triangle_CoversPixelCentresInside) {
  // Right angle at (1, 1), legs of 4 pixels; the hypotenuse x + y = 6 passes through centres.
  const Mesh mesh = mesh_of({{1, 1, 1}, {5, 1, 1}, {1, 5, 1}}, {{0, 1, 2}});
  const Raster raster = rasterize(mesh.vertices, mesh.faces, flat_camera(7, 7), {}, device());
  for (int y = 0; y < 7; ++y) {
    for (int x = 0; x < 7; ++x) {
      // A right edge: centres on it are not covered.
      EXPECT_EQ(raster.face.at(x, y) == 0, x >= 1 && y >= 1 && x + y + 1 < 6) << x << "," << y;
      if (raster.face.at(x, y) == 0) {
        EXPECT_EQ(raster.depth.at(x, y), 1);
        EXPECT_NEAR(raster.barycentric.at(x, y, 1), (x + 0.5 - 1) / 4, 1e-6);
        EXPECT_NEAR(raster.barycentric.at(x, y, 2), (y + 0.5 - 1) / 4, 1e-6);
      } else {
        EXPECT_TRUE(std::isinf(raster.depth.at(x, y)));
        EXPECT_EQ(raster.barycentric.at(x, y, 0), 0);
      }
    }
  }
}

/// Draws every face alone and counts how often each pixel is covered.
std::vector<int> coverage_counts(const Mesh& mesh, const Camera& camera, Device device) {
  std::vector<int> counts(static_cast<std::size_t>(camera.width) * camera.height, 0);
  for (Index f = 0; f < mesh.faces.rows(); ++f) {
    const Raster raster = rasterize(mesh.vertices, mesh.faces.row(f), camera, {}, device);
    for (std::size_t i = 0; i < counts.size(); ++i) {
      counts[i] += raster.face.data[i] >= 0;
    }
  }
  return counts;
}

TEST_P(RasterOnDevice, AdjacentTriangles_CoverEachPixelOnce) {
  // A grid over the whole image whose vertices and edges fall on pixel centres, and one jittered.
  Random random{1};
  for (const double jitter : {0.0, 0.3, 1.4}) {
    Mesh mesh = fixtures::grid(6, 6);
    for (Index v = 0; v < mesh.vertices.rows(); ++v) {
      const double x = -2.5 + 4 * 6 * mesh.vertices(v, 0);
      const double y = -2.5 + 4 * 6 * mesh.vertices(v, 2);
      const bool rim = v % 7 == 0 || v % 7 == 6 || v < 7 || v >= 42;
      mesh.vertices.row(v) << x + (rim ? 0 : uniform(random, -jitter, jitter)),
          y + (rim ? 0 : uniform(random, -jitter, jitter)), 1;
    }
    const auto counts = coverage_counts(mesh, flat_camera(20, 20), device());
    EXPECT_EQ(counts, std::vector<int>(counts.size(), 1));
  }
}

TEST_P(RasterOnDevice, FanAroundPixelCentre_CoversItOnce) {
  for (int blades = 3; blades < 12; ++blades) {
    std::vector<std::array<double, 3>> vertices = {{8.5, 8.5, 1}};
    std::vector<std::array<int, 3>> faces;
    for (int i = 0; i < blades; ++i) {
      const double angle = 2 * std::numbers::pi * i / blades;
      vertices.push_back({8.5 + 30 * std::cos(angle), 8.5 + 30 * std::sin(angle), 1});
      faces.push_back({0, i + 1, (i + 1) % blades + 1});
    }
    const Mesh mesh = mesh_of(vertices, faces);
    const auto counts = coverage_counts(mesh, flat_camera(17, 17), device());
    EXPECT_EQ(counts[8 * 17 + 8], 1);
    EXPECT_EQ(*std::max_element(counts.begin(), counts.end()), 1);
  }
}

TEST_P(RasterOnDevice, ClippedAdjacentTriangles_CoverEachPixelOnce) {
  // A floor that passes under the camera and far behind it, cut at the near plane.
  Mesh mesh = fixtures::grid(5, 5);
  mesh.vertices = mesh.vertices.array() * 40 - 20;
  mesh.vertices.col(1).setConstant(-1.5);
  const Camera camera = looking_camera(40, 30, 0.3);
  const auto counts = coverage_counts(mesh, camera, device());
  EXPECT_EQ(*std::max_element(counts.begin(), counts.end()), 1);
  for (int x = 0; x < 40; ++x) {
    EXPECT_EQ(counts[29 * 40 + x], 1);  // the bottom row sees floor everywhere
    EXPECT_EQ(counts[x], 0);            // the top row none
  }
}

TEST_P(RasterOnDevice, RasterizedTorus_AgreesWithRayCasting) {
  const Mesh mesh = fixtures::torus(50, 30);
  const TriangleTree tree = build_tree(mesh.vertices, mesh.faces);
  Camera camera = looking_camera(160, 120, 4);
  camera.camera_from_world_rotation =
      camera.camera_from_world_rotation *
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 0.3, 0.2).normalized()).toRotationMatrix();
  const Raster raster = rasterize(mesh.vertices, mesh.faces, camera, {}, device());
  std::vector<Ray> rays;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      rays.push_back({camera_center(camera), *ray_direction(camera, {x + 0.5, y + 0.5})});
    }
  }
  const auto hits = first_hits(tree, rays);
  int other_faces = 0;
  EXPECT_GT(covered_pixels(raster), 3000);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const RayHit& hit = hits[y * 160 + x];
      const int face = raster.face.at(x, y);
      if (face != hit.face) {
        // Only where the ray passes within the rounding (1/8192 pixel) of an edge.
        ++other_faces;
        const bool near_edge = (hit.face >= 0 && hit.barycentric.minCoeff() < 2e-3) ||
                               (face >= 0 && raster.barycentric.at(x, y, 0) < 2e-3f) ||
                               (face >= 0 && raster.barycentric.at(x, y, 1) < 2e-3f) ||
                               (face >= 0 && raster.barycentric.at(x, y, 2) < 2e-3f);
        EXPECT_TRUE(near_edge) << x << "," << y;
        continue;
      }
      if (face >= 0) {
        const Eigen::Vector3d point =
            rays[y * 160 + x].origin + hit.t * rays[y * 160 + x].direction;
        EXPECT_NEAR(raster.depth.at(x, y), camera_from_world(camera, point).z(), 2e-6);
        for (int k = 0; k < 3; ++k) {
          EXPECT_NEAR(raster.barycentric.at(x, y, k), hit.barycentric[k], 1e-4);
        }
      }
    }
  }
  EXPECT_LT(other_faces, 10);
}

TEST_P(RasterOnDevice, CpuAndDevice_AreBitIdentical) {
  Random random{2};
  Mesh mesh = fixtures::torus(80, 60);
  for (Index i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices.data()[i] += uniform(random, -0.05, 0.05);  // crossing faces, long ones
  }
  for (const double distance : {4.0, 1.2, 0.1}) {  // outside, in the hole, clipped
    const Camera camera = looking_camera(200, 150, distance);
    const Raster cpu = rasterize(mesh.vertices, mesh.faces, camera);
    EXPECT_TRUE(same(rasterize(mesh.vertices, mesh.faces, camera, {}, device()), cpu));
    EXPECT_GT(covered_pixels(cpu), 1000);
  }
}

TEST_P(RasterOnDevice, EquallyNearFaces_LowestIndexWins) {
  const Mesh mesh = mesh_of({{0, 0, 1}, {8, 0, 1}, {0, 8, 1}, {8, 8, 1}},
                            {{0, 3, 2}, {0, 1, 2}, {2, 1, 0}, {0, 1, 3}});
  const Raster raster = rasterize(mesh.vertices, mesh.faces, flat_camera(8, 8), {}, device());
  EXPECT_EQ(raster.face.at(2, 4), 0);  // in faces 0, 1, 2
  EXPECT_EQ(raster.face.at(4, 1), 1);  // in faces 1, 2, 3
  EXPECT_EQ(raster.face.at(6, 5), 3);
  EXPECT_EQ(raster.face.at(4, 6), 0);
}

TEST_P(RasterOnDevice, NearerFace_HidesOthers) {
  const Mesh mesh = mesh_of({{0, 0, 2}, {40, 0, 2}, {0, 40, 2}, {0, 0, 1}, {3, 0, 1}, {0, 3, 1}},
                            {{0, 1, 2}, {3, 4, 5}});
  const Raster raster = rasterize(mesh.vertices, mesh.faces, flat_camera(8, 8), {}, device());
  EXPECT_EQ(raster.face.at(0, 0), 1);
  EXPECT_EQ(raster.depth.at(0, 0), 1);
  EXPECT_EQ(raster.face.at(5, 5), 0);
  EXPECT_EQ(raster.depth.at(5, 5), 2);
}

TEST_P(RasterOnDevice, Barycentrics_ArePerspectiveCorrect) {
  // Along an edge from depth 1 to depth 3, the middle of the image is a quarter of the way.
  Camera camera = flat_camera(4, 2);
  const Mesh mesh =
      mesh_of({{0, 0, 1}, {12, 0, 3}, {0, 8, 1}, {12, 24, 3}}, {{0, 1, 2}, {2, 1, 3}});
  const Raster raster = rasterize(mesh.vertices, mesh.faces, camera, {}, device());
  ASSERT_EQ(raster.face.at(1, 0), 0);
  const double u = 1.5 / 4;          // of the image
  const double s = u / (3 - 2 * u);  // u = 3 s / (1 + 2 s)
  EXPECT_NEAR(raster.depth.at(1, 0), 1 + 2 * s, 1e-6);
  EXPECT_NEAR(raster.barycentric.at(1, 0, 1), s, 1e-6);
}

TEST_P(RasterOnDevice, NearPlane_ClipsFaces) {
  // A wall seen along its length, from behind the camera to 10 m ahead.
  Mesh mesh =
      mesh_of({{-1, -1, 5}, {-1, 1, 5}, {-1, -1, -10}, {-1, 1, -10}}, {{0, 2, 1}, {1, 2, 3}});
  const Camera camera = looking_camera(64, 64, 0);
  RasterOptions options;
  const Raster all = rasterize(mesh.vertices, mesh.faces, camera, options, device());
  EXPECT_GT(covered_pixels(all), 100);
  float nearest = 100;
  for (const float depth : all.depth.data) {
    nearest = std::min(nearest, depth);
  }
  EXPECT_GT(nearest, 2);  // the image's left border sees the wall at 1.2 * 64 / 30 m
  options.near = 4;
  const Raster cut = rasterize(mesh.vertices, mesh.faces, camera, options, device());
  EXPECT_LT(covered_pixels(cut), covered_pixels(all));
  for (const float depth : cut.depth.data) {
    EXPECT_GE(depth, 4 - 1e-3);
  }
  options.near = 11;
  EXPECT_EQ(covered_pixels(rasterize(mesh.vertices, mesh.faces, camera, options, device())), 0);
}

TEST_P(RasterOnDevice, FacesBeyondGuardBand_AreClipped) {
  // A triangle of millions of pixels, with a vertex a hair in front of the camera.
  const Mesh mesh =
      mesh_of({{-1e6, -1e6, -0.011}, {1e6, -1e6, -0.02}, {0, 2e6, -0.5}}, {{0, 1, 2}});
  const Camera camera = looking_camera(32, 32, 0);
  const Raster raster = rasterize(mesh.vertices, mesh.faces, camera, {}, device());
  EXPECT_EQ(covered_pixels(raster), 32 * 32);
}

TEST_P(RasterOnDevice, BackFaces_AreCulledOnRequest) {
  const Mesh mesh = fixtures::sphere(3);
  const Camera camera = looking_camera(64, 64, 3);
  RasterOptions cull;
  cull.cull_back = true;
  const Raster outside = rasterize(mesh.vertices, mesh.faces, camera, {}, device());
  EXPECT_TRUE(same(outside, rasterize(mesh.vertices, mesh.faces, camera, cull, device())));
  const Camera inside = looking_camera(64, 64, 0);
  EXPECT_EQ(covered_pixels(rasterize(mesh.vertices, mesh.faces, inside, {}, device())), 64 * 64);
  EXPECT_EQ(covered_pixels(rasterize(mesh.vertices, mesh.faces, inside, cull, device())), 0);
}

TEST_P(RasterOnDevice, LensDistortion_MovesVerticesAsProjected) {
  Camera camera = looking_camera(200, 200, 3);
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.2, 0.05, 0.001, -0.002};
  const Mesh mesh = fixtures::sphere(5);
  const Raster raster = rasterize(mesh.vertices, mesh.faces, camera, {}, device());
  int checked = 0;
  for (int y = 0; y < 200; y += 3) {
    for (int x = 0; x < 200; x += 3) {
      const int face = raster.face.at(x, y);
      if (face < 0) {
        continue;
      }
      Eigen::Vector3d point = Eigen::Vector3d::Zero();
      for (int k = 0; k < 3; ++k) {
        point +=
            raster.barycentric.at(x, y, k) * mesh.vertices.row(mesh.faces(face, k)).transpose();
      }
      const auto pixel = project(camera, point);
      ASSERT_TRUE(pixel.has_value());
      EXPECT_LT((*pixel - Eigen::Vector2d(x + 0.5, y + 0.5)).norm(), 0.05);
      ++checked;
    }
  }
  EXPECT_GT(checked, 300);
}

TEST_P(RasterOnDevice, FacesBeyondDistortionFold_AreOmitted) {
  Camera camera = looking_camera(64, 64, 0);
  const Mesh mesh = mesh_of({{-1, -1, -2}, {1, -1, -2}, {0, 3, 2}, {-1, 1, -2}, {1, 1, -2}},
                            {{0, 1, 2}, {0, 1, 4}});
  EXPECT_GT(covered_pixels(rasterize(mesh.vertices, mesh.faces.topRows(1), camera, {}, device())),
            0);
  camera.distortion_model = Distortion::Brown;
  camera.distortion = {-0.01};
  EXPECT_EQ(covered_pixels(rasterize(mesh.vertices, mesh.faces.topRows(1), camera, {}, device())),
            0);
  EXPECT_GT(covered_pixels(rasterize(mesh.vertices, mesh.faces, camera, {}, device())), 0);
}

TEST_P(RasterOnDevice, EmptyOrDegenerateInput_CoversNothing) {
  const Raster raster = rasterize(Points(0, 3), Triangles(0, 3), flat_camera(5, 3), {}, device());
  EXPECT_EQ(raster.face.data, std::vector<int>(15, -1));
  EXPECT_EQ(raster.depth.height, 3);
  // A line, a point, a face in one place, faces outside.
  const Mesh mesh =
      mesh_of({{1, 1, 1}, {3, 3, 1}, {2, 2, 1}, {-9, -9, 1}, {-9, -8, 1}, {-8, -9, 1}},
              {{0, 1, 2}, {0, 0, 0}, {0, 1, 1}, {3, 4, 5}});
  EXPECT_EQ(covered_pixels(rasterize(mesh.vertices, mesh.faces, flat_camera(5, 3), {}, device())),
            0);
}

TEST(Raster, AnyThreadCount_GivesTheSameRaster) {
  const Mesh mesh = fixtures::torus(60, 40);
  const Camera camera = looking_camera(150, 100, 3);
  set_thread_count(1);
  const Raster one = rasterize(mesh.vertices, mesh.faces, camera);
  set_thread_count(0);
  EXPECT_TRUE(same(one, rasterize(mesh.vertices, mesh.faces, camera)));
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(RasterRefuses, NonFiniteVertex_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  for (const double bad : {kNan, std::numeric_limits<double>::infinity(), 1e100}) {
    Points broken = mesh.vertices;
    broken(3, 2) = bad;
    ATELIER_EXPECT_REFUSED(rasterize(broken, mesh.faces, looking_camera(16, 16, 3)), LogicError,
                           "finite coordinates");
  }
}

TEST(RasterRefuses, FaceIndexOutOfRange_Throws) {
  Mesh mesh = fixtures::sphere(1);
  for (const int bad : {400, -1}) {
    mesh.faces(2, 1) = bad;
    ATELIER_EXPECT_REFUSED(rasterize(mesh.vertices, mesh.faces, looking_camera(16, 16, 3)),
                           LogicError, "a vertex that is not there");
  }
}

TEST(RasterRefuses, NearPlaneOutOfRange_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  for (const double near : {0.0, -1.0, kNan, 1e7}) {
    ATELIER_EXPECT_REFUSED(rasterize(mesh.vertices, mesh.faces, looking_camera(16, 16, 3), {near}),
                           LogicError, "near must be");
  }
}

TEST(RasterRefuses, CameraWithoutPixelsOrFocalLength_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  Camera camera = looking_camera(16, 16, 3);
  camera.width = 0;
  ATELIER_EXPECT_REFUSED(rasterize(mesh.vertices, mesh.faces, camera), DataError, "looking");
  camera = looking_camera(16, 16, 3);
  camera.fx = -1;
  ATELIER_EXPECT_REFUSED(rasterize(mesh.vertices, mesh.faces, camera), DataError, "looking");
}

TEST(RasterRefuses, TooLargeImage_Throws) {
  const Mesh mesh = fixtures::sphere(1);
  ATELIER_EXPECT_REFUSED(rasterize(mesh.vertices, mesh.faces, looking_camera(32769, 1, 3)),
                         DataError, "at most 32768 a side");
  ATELIER_EXPECT_REFUSED(rasterize(mesh.vertices, mesh.faces, looking_camera(1, 32769, 3)),
                         DataError, "1 x 32769 pixels");
}

TEST(RasterRefuses, CudaWithoutGpu_Throws) {
  if (cuda_available()) {
    GTEST_SKIP() << "there is a CUDA device";
  }
  const Mesh mesh = fixtures::sphere(1);
  ATELIER_EXPECT_REFUSED(
      rasterize(mesh.vertices, mesh.faces, looking_camera(16, 16, 3), {}, Device::Cuda),
      EnvironmentError, "CUDA");
}

}  // namespace
}  // namespace atelier

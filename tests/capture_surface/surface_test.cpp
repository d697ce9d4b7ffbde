// From points to surfaces, from label images to labels.

#include <Eigen/Geometry>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/surface/surface_from_points.h"
#include "capture/surface/surface_labels.h"
#include "core/error.h"
#include "core/mesh_statistics.h"
#include "core/random.h"

namespace atelier::fixtures {
namespace {

constexpr double kRadius = 0.3;

/// Points of a sphere with 0.5 mm of noise, where `z < cut`.
Mesh sphere_points(int count, double cut = 1) {
  Random random{5, 0, 0};
  std::vector<Eigen::Vector3d> places;
  while (static_cast<int>(places.size()) < count) {
    Eigen::Vector3d p(normal(random), normal(random), normal(random));
    p.normalize();
    if (p.z() * kRadius < cut) {
      places.push_back(p);
    }
  }
  Mesh mesh;
  mesh.vertices.resize(count, 3);
  mesh.normals.resize(count, 3);
  mesh.colors.resize(count, 3);
  mesh.confidence.resize(count);
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d& p = places[static_cast<std::size_t>(i)];
    mesh.vertices.row(i) = ((kRadius + 0.0005 * normal(random)) * p).transpose();
    mesh.normals.row(i) = p.transpose();
    mesh.colors.row(i).setConstant(p.x() > 0 ? 0.8 : 0.2);
    mesh.confidence(i) = 0.5f;
  }
  return mesh;
}

TEST(SurfaceFromPoints, SpherePoints_GiveAClosedRegularSphere) {
  const Mesh surface =
      surface_from_points(sphere_points(20000), {.octree_depth = 6, .edge_length = 0.02});
  const MeshStatistics statistics = mesh_statistics(surface);
  EXPECT_EQ(statistics.boundary_loops, 0);
  EXPECT_EQ(statistics.components, 1);
  ASSERT_TRUE(statistics.volume);
  EXPECT_NEAR(*statistics.volume, 4.0 / 3 * 3.14159265 * 0.027, 0.0015);
  EXPECT_NEAR(statistics.edge_lengths[2], 0.02, 0.004);
  const Eigen::VectorXd radii = surface.vertices.rowwise().norm();
  EXPECT_LT((radii.array() - kRadius).abs().maxCoeff(), 0.003);
  for (Index i = 0; i < surface.vertices.rows(); ++i) {
    if (std::abs(surface.vertices(i, 0)) > 0.02) {
      ASSERT_NEAR(surface.colors(i, 0), surface.vertices(i, 0) > 0 ? 0.8 : 0.2, 1e-6);
    }
  }
}

TEST(SurfaceFromPoints, UnsupportedRegion_StaysOpen) {
  const Mesh surface =
      surface_from_points(sphere_points(15000, 0.1), {.octree_depth = 6, .edge_length = 0.02});
  const MeshStatistics statistics = mesh_statistics(surface);
  EXPECT_EQ(statistics.components, 1);
  EXPECT_EQ(statistics.boundary_loops, 1);
  EXPECT_LT(surface.vertices.col(2).maxCoeff(), 0.1 + 0.025);
  EXPECT_GT(surface.vertices.col(2).maxCoeff(), 0.1);
}

TEST(SurfaceFromPoints, SparsePoints_SupportTheSurfaceBetween) {
  // 35 mm apart: nearly everywhere farther from a point than the trim.
  const Mesh surface =
      surface_from_points(sphere_points(1000), {.octree_depth = 5, .edge_length = 0.03});
  EXPECT_GT(mesh_statistics(surface).area, 0.97 * 4 * 3.14159265 * kRadius * kRadius);
}

TEST(SurfaceFromPoints, SurfaceBeyondTrimDistance_IsRemoved) {
  const Mesh points = sphere_points(15000, 0.1);
  const auto highest = [&](double trim) {
    return surface_from_points(points, {.octree_depth = 6, .trim = trim, .edge_length = 0.02})
        .vertices.col(2)
        .maxCoeff();
  };
  EXPECT_LT(highest(0.012), highest(0.04) - 0.01);
}

TEST(SurfaceFromPoints, SurfaceBeyondLastPoints_HasZeroConfidence) {
  const double end = 0.1;
  const Mesh surface =
      surface_from_points(sphere_points(15000, end), {.octree_depth = 6, .edge_length = 0.02});
  int beyond = 0;
  int gaps = 0;
  for (Index i = 0; i < surface.vertices.rows(); ++i) {
    const double z = surface.vertices(i, 2);
    beyond += z > end + 0.012 ? 1 : 0;
    gaps += z < end && surface.confidence(i) == 0 ? 1 : 0;
    if (z > end + 0.012) {  // points are 9 mm apart
      ASSERT_EQ(surface.confidence(i), 0) << z;
    }
  }
  EXPECT_GT(beyond, 0);
  EXPECT_LT(gaps, 0.005 * static_cast<double>(surface.vertices.rows()));
}

TEST(SurfaceFromPoints, OutlierPoints_AreRemoved) {
  Mesh points = sphere_points(3000);
  points.vertices.row(17) << 1, 1, 1;
  points.vertices.row(99) << -1, 0.7, 1;
  const Mesh clean = without_outliers(points);
  EXPECT_LT(clean.vertices.rowwise().norm().maxCoeff(), kRadius + 0.01);
  EXPECT_GT(clean.vertices.rows(), 2900);
  EXPECT_EQ(clean.normals.rows(), clean.vertices.rows());
  EXPECT_EQ(clean.colors.rows(), clean.vertices.rows());
}

TEST(SurfaceFromPoints, TooFewPointsOrNoNormals_AreRefused) {
  EXPECT_THROW(surface_from_points(sphere_points(50)), DataError);
  EXPECT_THROW(without_outliers(sphere_points(50)), DataError);
  Mesh points = sphere_points(200);
  points.normals.resize(0, 3);
  EXPECT_THROW(surface_from_points(points), DataError);
  points = sphere_points(200);
  points.vertices(3, 1) = std::nan("");
  EXPECT_THROW(surface_from_points(points), DataError);
}

/// A ball whose upper half has label 3, the lower 4, before eight cameras.
struct LabelledBall {
  Mesh mesh = sphere();
  std::vector<LabelView> views;

  static const Mesh& sphere() {
    static const Mesh made =
        surface_from_points(sphere_points(10000), {.octree_depth = 6, .edge_length = 0.02});
    return made;
  }

  LabelledBall() {
    for (int i = 0; i < 8; ++i) {
      LabelView view;
      const double azimuth = i * 0.785398;
      Camera& camera = view.camera;
      camera.width = camera.height = 100;
      camera.fx = camera.fy = 180;
      camera.cx = camera.cy = 50;
      const Eigen::Vector3d centre = 1.5 * Eigen::Vector3d(std::sin(azimuth), 0, std::cos(azimuth));
      const Eigen::Vector3d z = -centre.normalized();
      const Eigen::Vector3d x = Eigen::Vector3d(0, -1, 0).cross(z);
      camera.camera_from_world_rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
      camera.camera_from_world_translation = -camera.camera_from_world_rotation * centre;
      view.labels = ByteImage(100, 100, 1);
      for (int py = 0; py < 100; ++py) {
        for (int px = 0; px < 100; ++px) {
          const Eigen::Vector2d from_centre(px + 0.5 - 50, py + 0.5 - 50);
          if (from_centre.norm() < 180 * 0.3 / 1.47) {
            view.labels.at(px, py) = py < 50 ? 3 : 4;
          }
        }
      }
      views.push_back(std::move(view));
    }
  }
  double right_share(const std::vector<std::uint8_t>& labels) const {
    double right = 0;
    double all = 0;
    for (Index i = 0; i < mesh.vertices.rows(); ++i) {
      if (std::abs(mesh.vertices(i, 1)) > 0.01) {
        right += labels[static_cast<std::size_t>(i)] == (mesh.vertices(i, 1) > 0 ? 3 : 4) ? 1 : 0;
        all += 1;
      }
    }
    return right / all;
  }
};

TEST(SurfaceLabels, ConsistentViews_GiveTheirLabels) {
  const LabelledBall ball;
  const LabelVotes votes = label_votes(ball.mesh, ball.views);
  EXPECT_THAT(votes.ids, ::testing::ElementsAre(3, 4));
  EXPECT_GT(ball.right_share(smooth_labels(ball.mesh, votes)), 0.99);
}

TEST(SurfaceLabels, WrongViewAndSaltNoise_AreOutvoted) {
  LabelledBall ball;
  for (std::uint8_t& label : ball.views[2].labels.data) {
    label = label == 3 ? 4 : label == 4 ? 3 : 0;
  }
  Random random{9, 0, 0};
  for (LabelView& view : ball.views) {
    for (std::uint8_t& label : view.labels.data) {
      label = uniform(random) < 0.1 ? 7 : label;
    }
  }
  const LabelVotes votes = label_votes(ball.mesh, ball.views);
  EXPECT_LT(votes.trust[2], 0.5 * votes.trust[3]);
  EXPECT_GT(ball.right_share(smooth_labels(ball.mesh, votes)), 0.97);
}

/// What a view's stereo would find of the ball, everywhere as sure.
DepthMap map_of_ball(const Camera& camera, float confidence) {
  DepthMap map;
  map.camera = camera;
  map.depth = Image(camera.width, camera.height, 1);
  map.confidence = Image(camera.width, camera.height, 1, confidence);
  const Eigen::Vector3d centre = camera_center(camera);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = ray_direction(camera, {x + 0.5, y + 0.5})->normalized();
      const double b = ray.dot(centre);
      const double inside = b * b - centre.squaredNorm() + kRadius * kRadius;
      if (inside > 0) {
        const double distance = -b - std::sqrt(inside);
        map.depth.at(x, y) =
            static_cast<float>(distance * camera.camera_from_world_rotation.row(2).dot(ray));
      }
    }
  }
  return map;
}

/// Two views 45 degrees apart, of which the second says the wrong labels: the share of the vertices
/// between them whose label is right, with so much confidence in each.
double right_between(float confidence_of_right, float confidence_of_wrong, double shift = 0) {
  LabelledBall ball;
  ball.views.resize(2);
  for (std::uint8_t& label : ball.views[1].labels.data) {
    label = label == 3 ? 4 : label == 4 ? 3 : 0;
  }
  DepthMap right = map_of_ball(ball.views[0].camera, confidence_of_right);
  DepthMap wrong = map_of_ball(ball.views[1].camera, confidence_of_wrong);
  for (float& depth : wrong.depth.data) {
    depth += static_cast<float>(shift);
  }
  ball.views[0].depth = &right;
  ball.views[1].depth = &wrong;
  SurfaceLabelOptions options;
  options.rounds = 1;  // in the first round both are trusted
  const auto labels =
      smooth_labels(ball.mesh, label_votes(ball.mesh, ball.views, options), options);
  const Eigen::Vector3d between = (camera_center(ball.views[0].camera).normalized() +
                                   camera_center(ball.views[1].camera).normalized())
                                      .normalized();
  double good = 0;
  double all = 0;
  for (Index v = 0; v < ball.mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d place = ball.mesh.vertices.row(v).transpose();
    if (place.normalized().dot(between) > 0.94 && std::abs(place.y()) > 0.04) {
      good += labels[static_cast<std::size_t>(v)] == (place.y() > 0 ? 3 : 4) ? 1 : 0;
      all += 1;
    }
  }
  EXPECT_GT(all, 50);
  return good / all;
}

TEST(SurfaceLabels, LessConfidentWrongView_IsOutvoted) {
  EXPECT_GT(right_between(0.95F, 0.05F), 0.97);
  EXPECT_LT(right_between(0.05F, 0.95F), 0.03);  // it is confidence that decides
}

TEST(SurfaceLabels, WrongViewOfOtherSurface_IsOutvoted) {
  EXPECT_GT(right_between(0.9F, 0.95F, 0.1), 0.97);
}

TEST(SurfaceLabels, UnconfidentVertex_TakesItsNeighborsLabel) {
  LabelledBall ball;
  LabelVotes votes = label_votes(ball.mesh, ball.views);
  // A speck that votes for the other label: kept where the surface is sure, else not.
  Index speck = 0;
  (ball.mesh.vertices.rowwise() - Eigen::RowVector3d(0.2, 0.2, 0.05))
      .rowwise()
      .squaredNorm()
      .minCoeff(&speck);
  votes.probability.row(speck) << 0.001, 0.999;
  const auto at_confidence = [&](float confidence) {
    ball.mesh.confidence = Eigen::VectorXf::Constant(ball.mesh.vertices.rows(), 1);
    ball.mesh.confidence[speck] = confidence;
    return smooth_labels(ball.mesh, votes)[static_cast<std::size_t>(speck)];
  };
  EXPECT_EQ(at_confidence(1), 4);
  EXPECT_EQ(at_confidence(0), 3);
}

TEST(SurfaceLabels, NoViews_GiveUnknownLabels) {
  const LabelledBall ball;
  const auto labels = smooth_labels(ball.mesh, label_votes(ball.mesh, {}));
  EXPECT_EQ(static_cast<Index>(labels.size()), ball.mesh.vertices.rows());
  EXPECT_THAT(labels, ::testing::Each(255));
}

TEST(SurfaceLabels, ImagesOfOtherSize_AreRefused) {
  LabelledBall ball;
  ball.views[0].labels = ByteImage(10, 10, 1);
  EXPECT_THROW(label_votes(ball.mesh, ball.views), LogicError);
  ball = {};
  const DepthMap other;
  ball.views[3].depth = &other;
  EXPECT_THROW(label_votes(ball.mesh, ball.views), LogicError);
}

}  // namespace
}  // namespace atelier::fixtures

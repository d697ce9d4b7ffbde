#include "registration/flattening/rest_surface.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/normals.h"
#include "core/random.h"
#include "tests/support/refusals.h"
#include "tests/support/shapes.h"

namespace atelier {
namespace {

using fixtures::tube;

constexpr double kTubeRadius = 0.15;
constexpr double kLength = 0.6;

/// A tube of cloth, `kLength` long.
Mesh cloth() {
  Mesh mesh = tube(63, 40, kLength / kTubeRadius);
  mesh.vertices *= kTubeRadius;
  return mesh;
}

/// The tube in folds along it, of six centimetres and a depth that goes round with the frame: as
/// long around as before, so that chords are shorter and the tube narrower where it folds.
Points folded(const Mesh& mesh, int frame, double depth, double noise) {
  Random random{static_cast<std::uint64_t>(frame)};
  Points points = mesh.vertices;
  for (Index v = 0; v < points.rows(); ++v) {
    const double angle = std::atan2(points(v, 2), points(v, 0));
    const double here = 0.5 + 0.5 * std::cos(angle - 0.7 * frame);
    const double wave = std::cos(16 * angle + frame);
    const double radius = kTubeRadius * (1 - 8 * depth * here) + 0.5 * depth * here * wave;
    points(v, 0) = radius * std::cos(angle);
    points(v, 2) = radius * std::sin(angle);
    for (int k = 0; k < 3; ++k) {
      points(v, k) += noise * normal(random);
    }
  }
  return points;
}

double area_of(const Mesh& mesh, const Points& vertices) {
  return face_areas(vertices, mesh.faces).sum();
}

// Each frame lacks 4% of the area, all of them together next to nothing.
TEST(RestSurface, WanderingFolds_DoNotShrinkTheRestSurface) {
  const Mesh truth = cloth();
  std::vector<Points> frames;
  for (int frame = 0; frame < 24; ++frame) {
    frames.push_back(folded(truth, frame, 0.01, 0));
  }
  Mesh given = truth;
  given.vertices = truth.vertices;
  given.vertices.col(0) *= 0.95;
  given.vertices.col(2) *= 0.95;
  const Points rest = rest_surface(given, frames);
  const double area = area_of(truth, truth.vertices);
  for (const Points& frame : frames) {
    EXPECT_LT(area_of(truth, frame), 0.985 * area);
  }
  EXPECT_LT(area_of(truth, given.vertices), 0.955 * area);
  EXPECT_NEAR(area_of(truth, rest), area, 0.02 * area);
  EXPECT_LT((rest - given.vertices).rowwise().norm().maxCoeff(), 0.03);
}

// A limb that bends: what its inside folds away lies along the limb, and comes back along it alone.
TEST(RestSurface, Fold_ShrinksTheLengthAcrossItOnly) {
  const Mesh truth = cloth();
  const auto squeezed = [&](double share) {  // along the tube, by so much
    Points points = truth.vertices;
    points.col(1) *= share;
    return points;
  };
  std::vector<Points> frames(24, squeezed(0.85));
  for (int frame = 0; frame < 8; ++frame) {
    frames[static_cast<std::size_t>(frame)] = truth.vertices;
  }
  Mesh given = truth;
  given.vertices = frames.back();
  const Points rest = rest_surface(given, frames);
  const Eigen::Vector3d large = rest.colwise().maxCoeff() - rest.colwise().minCoeff();
  EXPECT_NEAR(large.x(), 2 * kTubeRadius, 0.002);
  EXPECT_NEAR(large.y(), kLength, 0.006);
  EXPECT_NEAR(large.z(), 2 * kTubeRadius, 0.002);

  // None of these has all of it: one end is squeezed in some, the other in the rest.
  for (int frame = 0; frame < 24; ++frame) {
    Points& points = frames[static_cast<std::size_t>(frame)];
    points = truth.vertices;
    for (Index v = 0; v < points.rows(); ++v) {
      double& y = points(v, 1);
      const double off = y - kLength / 2;
      y = (off > 0) == (frame % 2 == 0) ? kLength / 2 + 0.85 * off : y;
    }
  }
  const Points both = rest_surface(given, frames);
  const Eigen::Vector3d whole = both.colwise().maxCoeff() - both.colwise().minCoeff();
  EXPECT_NEAR(whole.x(), 2 * kTubeRadius, 0.004);
  EXPECT_NEAR(whole.y(), kLength, 0.012);
}

// A triangle that a frame has crushed to a line lacks a lot in a direction that it does not tell.
TEST(RestSurface, CrushedTriangles_AreIgnored) {
  const Mesh truth = cloth();
  std::vector<Points> frames(8, truth.vertices);
  const Triangles& faces = truth.faces;
  for (Points& frame : frames) {
    for (const Index f : {Index{900}, Index{1700}, Index{2600}}) {
      const Eigen::RowVector3d a = frame.row(faces(f, 0));
      const Eigen::RowVector3d b = frame.row(faces(f, 1));
      frame.row(faces(f, 2)) = 0.5 * (a + b) + 1e-5 * (frame.row(faces(f, 2)) - a);
    }
  }
  const Points crushed_once = frames[0];
  // In one frame of them all is as it was cut.
  frames[3] = truth.vertices;
  const Points rest = rest_surface(truth, frames, {.quantile = 1});
  EXPECT_NEAR(area_of(truth, rest), area_of(truth, truth.vertices), 0.01);
  EXPECT_LT((rest - truth.vertices).rowwise().norm().maxCoeff(), 0.02);

  // Another one in each frame: at the default quantile each is as it was cut in most of them.
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i] = truth.vertices;
    const auto f = static_cast<Index>(300 * i + 450);
    frames[i].row(faces(f, 2)) = 0.5 * (frames[i].row(faces(f, 0)) + frames[i].row(faces(f, 1)));
    frames[i](faces(f, 2), 1) += 1e-7;
  }
  const Points each = rest_surface(truth, frames);
  EXPECT_NEAR(area_of(truth, each), area_of(truth, truth.vertices),
              0.002 * area_of(truth, truth.vertices));
  EXPECT_LT((each - truth.vertices).rowwise().norm().maxCoeff(), 0.02);

  const std::vector<Points> crushed(8, crushed_once);
  const Points same = rest_surface(truth, crushed);
  EXPECT_TRUE(same.allFinite());
  EXPECT_LT((same - crushed_once).rowwise().norm().maxCoeff(), 0.01);
}

// Whoever wears it turns and walks on: it comes back where the mesh is.
TEST(RestSurface, RestSurface_IsPlacedWhereTheMeshIs) {
  const Mesh truth = cloth();
  std::vector<Points> frames;
  for (int frame = 0; frame < 8; ++frame) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.8 + 0.1 * frame, Eigen::Vector3d::UnitY()).toRotationMatrix();
    frames.push_back((truth.vertices * turn.transpose()).rowwise() +
                     Eigen::RowVector3d(1, 0.1, -2));
  }
  const Points rest = rest_surface(truth, frames);
  EXPECT_LT((rest - truth.vertices).rowwise().norm().maxCoeff(), 1e-6);
}

TEST(RestSurface, UnfoldedSequence_StaysUnchanged) {
  const Mesh truth = cloth();
  const std::vector<Points> frames(6, truth.vertices);
  const Points rest = rest_surface(truth, frames);
  EXPECT_LT((rest - truth.vertices).rowwise().norm().maxCoeff(), 1e-6);
}

// Noise lengthens the long quantile of every edge: registered frames, which are smooth, have little
// (0.3 mm of each vertex by itself is 4% of the area).
TEST(RestSurface, Noise_AddsLittleArea) {
  const Mesh truth = cloth();
  std::vector<Points> frames;
  for (int frame = 0; frame < 24; ++frame) {
    frames.push_back(folded(truth, frame, 0, 0.0003));
  }
  const double area = area_of(truth, truth.vertices);
  EXPECT_NEAR(area_of(truth, rest_surface(truth, frames)), area, 0.05 * area);
}

TEST(RestSurface, VertexWithoutFaces_IsHarmless) {
  Mesh mesh = cloth();
  const Index count = mesh.vertices.rows();
  mesh.vertices.conservativeResize(count + 1, 3);
  mesh.vertices.row(count) << 0, 1, 0;
  Points wider = 1.05 * mesh.vertices;
  const Points rest = rest_surface(mesh, std::vector<Points>(6, wider));
  EXPECT_NEAR(area_of(mesh, rest), 1.05 * 1.05 * area_of(mesh, mesh.vertices), 1e-4);
}

TEST(RestSurface, TooFewFrames_GiveTheMesh) {
  const Mesh truth = cloth();
  const std::vector<Points> frames(4, Points(0.9 * truth.vertices));
  EXPECT_EQ(rest_surface(truth, frames), truth.vertices);
  EXPECT_EQ(rest_surface(truth, {}), truth.vertices);
}

TEST(RestSurfaceRefused, FramesOfAnotherMeshOrNonFinite_AreRefused) {
  const Mesh truth = cloth();
  ATELIER_EXPECT_REFUSED(rest_surface(truth, {Points(truth.vertices.topRows(5))}), LogicError,
                         "in each frame");
  Points broken = truth.vertices;
  broken(3, 1) = std::numeric_limits<double>::quiet_NaN();
  ATELIER_EXPECT_REFUSED(rest_surface(truth, {broken}), LogicError, "finite");
  ATELIER_EXPECT_REFUSED(rest_surface(truth, {}, {.quantile = 1.5}), LogicError, "quantile");
  ATELIER_EXPECT_REFUSED(rest_surface(truth, {}, {.reach = 0}), LogicError, "reach");
}

}  // namespace
}  // namespace atelier

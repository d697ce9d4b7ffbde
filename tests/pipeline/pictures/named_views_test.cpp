// What images call the sides of somebody, whichever way they face.
#include "pipeline/pictures/named_views.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "pipeline/pictures/flatten_pictures.h"
#include "pipeline/pictures/template_pictures.h"
#include "tests/support/shapes.h"
#include "tests/support/turned.h"

namespace atelier {
namespace {

using fixtures::turned;

Eigen::Vector3d direction(double degrees) {
  const double turn = degrees * std::numbers::pi / 180;
  return {std::sin(turn), 0, std::cos(turn)};
}

TEST(NamedViews, Front_IsWhereTheSubjectFaces) {
  for (const double degrees : {0.0, 37.0, 90.0, 180.0, 300.0}) {
    const auto [front, back] = two_sides(direction(degrees), direction(degrees + 50));
    EXPECT_EQ(front.name, "front");
    EXPECT_EQ(back.name, "back");
    EXPECT_NEAR(direction(degrees).dot(direction(front.view.azimuth * 180 / std::numbers::pi)), 1,
                1e-9);
    EXPECT_NEAR(direction(degrees).dot(direction(back.view.azimuth * 180 / std::numbers::pi)), -1,
                1e-9);
  }
}

TEST(NamedViews, UnknownFront_NamesSidesByViewDirection) {
  const auto names = [](double degrees) {
    const auto [one, other] = two_sides(Eigen::Vector3d::Zero(), direction(degrees));
    return one.name + ", " + other.name;
  };
  EXPECT_EQ(names(0), "from +Z, from -Z");
  EXPECT_EQ(names(90), "from +X, from -X");
  EXPECT_EQ(names(270), "from -X, from +X");
  EXPECT_EQ(names(42), "from 42 deg, from 222 deg");
  EXPECT_EQ(names(-30), "from 330 deg, from 150 deg");
  EXPECT_EQ(names(359.9), "from +Z, from -Z");
}

/// The mean difference of two pictures.
double difference(const Image& a, const Image& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    sum += std::abs(a.data[i] - b.data[i]);
  }
  return sum / static_cast<double>(a.data.size());
}

// A body with a nose, so that its sides differ, and a collar that is cut off askew.
TEST(NamedViews, GarmentImages_AreIndependentOfTheFacing) {
  Mesh body = fixtures::sphere(3);
  body.vertices *= 0.2;
  for (Index v = 0; v < body.vertices.rows(); ++v) {
    body.vertices(v, 2) += body.vertices(v, 2) > 0.17 ? 0.1 : 0;
  }
  Mesh collar = fixtures::tube(24, 6, 0.2);
  collar.vertices.col(0) *= 0.25;
  collar.vertices.col(2) *= 0.25;
  collar.vertices.col(1) += 0.3 * collar.vertices.col(2) + 0.1 * collar.vertices.col(0);
  const auto picture = [&](double degrees, bool known) {
    GarmentTemplate made;
    made.garment.name = "collar";
    made.garment.mesh = turned(collar, degrees);
    made.garment.mesh.uvs = Points2::Zero(0, 2);
    made.garment.mesh.uv_faces.resize(0, 3);
    made.dynamic.assign(static_cast<std::size_t>(collar.vertices.rows()), 0);
    made.facing = known ? direction(degrees) : Eigen::Vector3d::Zero();
    ClothedFrames frames;
    frames.body_faces = body.faces;
    frames.frame_ids = {0};
    frames.load = [&](Index /*frame_idx*/) {
      return ClothedFrame{{}, turned(body, degrees).vertices};
    };
    return template_picture({made}, frames);
  };
  const Image ahead = picture(0, true);
  // Rays are cast at random, and others where the scene is turned.
  const double noise = difference(ahead, picture(130, true));
  EXPECT_LT(noise, 0.015);
  EXPECT_GT(difference(ahead, picture(130, false)), 2 * noise);  // of the world's axes
}

}  // namespace
}  // namespace atelier

// Views that disagree with the others about where somebody is.

#include "capture/people/second_look.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "capture/keypoint_schema.h"
#include "core/error.h"
#include "tests/support/refusals.h"

namespace atelier::fixtures {
namespace {

/// Four cameras of 800 x 1000 in a ring of 4 m, 1 m up, that look at (0, 1, 0).
std::vector<Camera> ring() {
  std::vector<Camera> cameras;
  for (int i = 0; i < 4; ++i) {
    const double angle = 2 * std::numbers::pi * i / 4 + 0.3;
    Camera camera;
    camera.id = "cam" + std::to_string(i);
    camera.width = 800;
    camera.height = 1000;
    camera.fx = camera.fy = 1100;
    camera.cx = 400;
    camera.cy = 500;
    const Eigen::Vector3d center(4 * std::sin(angle), 1, 4 * std::cos(angle));
    const Eigen::Vector3d forward = (Eigen::Vector3d(0, 1, 0) - center).normalized();
    const Eigen::Vector3d down(0, -1, 0);
    camera.camera_from_world_rotation.row(0) = down.cross(forward).transpose();
    camera.camera_from_world_rotation.row(1) = down.transpose();
    camera.camera_from_world_rotation.row(2) = forward.transpose();
    camera.camera_from_world_translation = -camera.camera_from_world_rotation * center;
    cameras.push_back(camera);
  }
  return cameras;
}

/// Somebody who stands at `x` m, the arms spread: rough places of the schema's points.
std::vector<Eigen::Vector3d> standing(double x, double lift = 0) {
  const KeypointSchema& schema = keypoint_schema(kBuiltInSchema);
  std::vector<Eigen::Vector3d> points;
  for (const std::string& name : schema.points) {
    const double side = name.starts_with("left_") ? 1 : name.starts_with("right_") ? -1 : 0;
    const auto has = [&](const char* part) { return name.find(part) != std::string::npos; };
    Eigen::Vector3d at(0.04 * side, 1.6, 0.1);
    if (has("shoulder")) {
      at = {0.2 * side, 1.4, 0};
    } else if (has("elbow")) {
      at = {0.45 * side, 1.35, 0};
    } else if (has("wrist")) {
      at = {0.7 * side, 1.3, 0};
    } else if (has("little") || has("index_1") || has("thumb")) {
      at = {0.77 * side, 1.28 + (has("thumb") ? 0.03 : 0), 0.02};
    } else if (has("hip")) {
      at = {0.12 * side, 0.95, 0};
    } else if (has("knee")) {
      at = {0.14 * side, 0.5, 0.03};
    } else if (has("ankle")) {
      at = {0.15 * side, 0.1, 0};
    } else if (has("heel")) {
      at = {0.15 * side, 0.03, -0.05};
    } else if (has("foot")) {
      at = {0.17 * side, 0.02, 0.15};
    }
    points.emplace_back(at + Eigen::Vector3d(x, lift, 0));
  }
  return points;
}

PersonLandmarks seen_by(const Camera& camera, const std::vector<Eigen::Vector3d>& points) {
  PersonLandmarks person;
  person.presence = 1;
  person.points = DetectedPoints::Zero(kLandmarks, 3);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto pixel = project(camera, points[k]);
    person.points.row(static_cast<Index>(k)) << pixel->x(), pixel->y(), 0.9;
  }
  return person;
}

PeopleInViews views_of(const std::vector<Camera>& cameras, int frames, double step = 0.01) {
  PeopleInViews people(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (int f = 0; f < frames; ++f) {
      people[c].push_back({seen_by(cameras[c], standing(step * f))});
    }
  }
  return people;
}

TEST(SecondLook, ViewsThatAgree_AreNotLookedAtAgain) {
  const auto cameras = ring();
  PeopleInViews people = views_of(cameras, 3);
  int mirrored = 0;
  EXPECT_TRUE(second_looks(cameras, people, {}, mirrored).empty());
  EXPECT_EQ(mirrored, 0);
}

TEST(SecondLook, PersonMissingInAView_IsProposedWhereTheOthersSeeIt) {
  const auto cameras = ring();
  PeopleInViews people = views_of(cameras, 3);
  people[2][1].clear();
  int mirrored = 0;
  const auto looks = second_looks(cameras, people, {}, mirrored);
  ASSERT_EQ(looks.size(), 1U);
  EXPECT_EQ(looks[0].camera, 2);
  EXPECT_EQ(looks[0].frame, 1U);
  EXPECT_EQ(looks[0].person, -1);
  const PersonLandmarks truth = seen_by(cameras[2], standing(0.01));
  for (Index k = 0; k < kLandmarks; ++k) {
    const Eigen::Vector2d at = into_crop(looks[0].crop, truth.points.row(k).head<2>().transpose());
    EXPECT_GT(at.minCoeff(), 0.02) << k;
    EXPECT_LT(at.maxCoeff(), 0.98) << k;
  }
  EXPECT_TRUE(take_second_look(looks[0], truth, cameras[2], {}, 0.5, people));
  ASSERT_EQ(people[2][1].size(), 1U);
  EXPECT_EQ(people[2][1][0].points, truth.points);
}

TEST(SecondLook, ViewOfSomethingElse_IsReplacedByWhatAgreesBetter) {
  const auto cameras = ring();
  PeopleInViews people = views_of(cameras, 2);
  const PersonLandmarks truth = people[0][1][0];
  people[0][1][0].points.leftCols<1>().array() += 150;
  int mirrored = 0;
  const auto looks = second_looks(cameras, people, {}, mirrored);
  ASSERT_EQ(looks.size(), 1U);
  EXPECT_EQ(looks[0].person, 0);
  EXPECT_GT(looks[0].error, 100);
  PersonLandmarks worse = truth;
  worse.points.leftCols<1>().array() -= 300;
  EXPECT_FALSE(take_second_look(looks[0], worse, cameras[0], {}, 0.5, people));
  PersonLandmarks absent = truth;
  absent.presence = 0.2;
  EXPECT_FALSE(take_second_look(looks[0], absent, cameras[0], {}, 0.5, people));
  EXPECT_TRUE(take_second_look(looks[0], truth, cameras[0], {}, 0.5, people));
  EXPECT_EQ(people[0][1][0].points, truth.points);
}

TEST(SecondLook, MirroredPerson_IsTurnedBack) {
  const auto cameras = ring();
  PeopleInViews people = views_of(cameras, 2);
  const KeypointSchema& schema = keypoint_schema(kBuiltInSchema);
  const PersonLandmarks truth = people[1][0][0];
  for (Index k = 0; k < kLandmarks; ++k) {
    people[1][0][0].points.row(k) = truth.points.row(schema.mirror[static_cast<std::size_t>(k)]);
  }
  int mirrored = 0;
  EXPECT_TRUE(second_looks(cameras, people, {}, mirrored).empty());
  EXPECT_EQ(mirrored, 1);
  EXPECT_EQ(people[1][0][0].points, truth.points);
}

TEST(SecondLook, OneOfTwoPeopleMissing_IsProposed) {
  const auto cameras = ring();
  PeopleInViews people = views_of(cameras, 3);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (PeopleInImage& image : people[c]) {
      image.insert(image.begin(), seen_by(cameras[c], standing(0.9)));
    }
  }
  people[3][2].erase(people[3][2].begin());
  int mirrored = 0;
  const auto looks = second_looks(cameras, people, {}, mirrored);
  ASSERT_EQ(looks.size(), 1U);
  EXPECT_EQ(looks[0].camera, 3);
  const Eigen::Vector2d hips = *project(cameras[3], {0.9, 0.95, 0});
  EXPECT_LT((looks[0].crop.center - hips).norm(), 5);
}

TEST(SecondLook, PersonOutsideTheImage_IsNotLookedFor) {
  auto cameras = ring();
  PeopleInViews people = views_of(cameras, 2);
  cameras[0].cx = -3000;  // looks past
  people[0][0].clear();
  people[0][1].clear();
  int mirrored = 0;
  EXPECT_TRUE(second_looks(cameras, people, {}, mirrored).empty());
}

TEST(SecondLook, NobodyAnywhere_ProposesNothingAndOtherSizesAreRefused) {
  const auto cameras = ring();
  PeopleInViews nobody(cameras.size(), std::vector<PeopleInImage>(2));
  int mirrored = 0;
  EXPECT_TRUE(second_looks(cameras, nobody, {}, mirrored).empty());
  nobody.pop_back();
  ATELIER_EXPECT_REFUSED(second_looks(cameras, nobody, {}, mirrored), LogicError,
                         "people of each camera");
}

TEST(FoundPoints, PointsBelowThresholdOrOutside_WereNotFound) {
  PersonLandmarks person;
  person.points = DetectedPoints::Constant(kLandmarks, 3, 0.8);
  person.points.leftCols<2>().array() = 50;
  person.points(1, 0) = -1;
  person.points(2, 1) = 100;
  person.points(3, 2) = 0.05;
  const Keypoints2d points = found_points(person, 200, 100, 0.1);
  EXPECT_EQ(points(0, 2), 0.8);
  for (const Index k : {1, 2, 3}) {
    EXPECT_EQ(points.row(k).norm(), 0);
  }
}

}  // namespace
}  // namespace atelier::fixtures

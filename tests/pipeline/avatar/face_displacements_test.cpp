#include "pipeline/avatar/face_displacements.h"

#include <Eigen/Geometry>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/random.h"

namespace atelier {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::FloatNear;

constexpr Index kPoints = 68;
constexpr Index kChin = 8;

/// The same random face in several frames, the head turned and moved in each; in the odd ones the
/// chin hangs lower by `drop` metres in the head's own axes.
std::vector<Keypoints3d> talking_head(double drop) {
  Random random{7, 1};
  Points face(kPoints, 3);
  for (Index k = 0; k < kPoints; ++k) {
    face.row(k) << 0.06 * normal(random), 0.08 * normal(random), 0.03 * normal(random);
  }
  std::vector<Keypoints3d> frames;
  for (int f = 0; f < 6; ++f) {
    Points own = face;
    own(kChin, 1) -= f % 2 == 1 ? drop : 0;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.3 * f, Eigen::Vector3d(1, 2, 0.5).normalized()).toRotationMatrix();
    Keypoints3d keypoints = Keypoints3d::Ones(kPoints, 4);
    keypoints.leftCols<3>() =
        (own * turn.transpose()).rowwise() + Eigen::RowVector3d(0.1 * f, 1.6, -0.2 * f);
    frames.push_back(keypoints);
  }
  return frames;
}

TEST(FaceDisplacements, HeadThatOnlyMoves_HasNone) {
  for (const std::vector<float>& off : face_displacements(talking_head(0))) {
    EXPECT_THAT(off, Each(FloatNear(0, 1e-4F)));
  }
}

TEST(FaceDisplacements, ChinThatHangsLower_IsToldInCentimetres) {
  const auto off = face_displacements(talking_head(0.02));
  ASSERT_EQ(off.size(), 6U);
  for (std::size_t f = 0; f < off.size(); ++f) {
    const float* chin = &off[f][3 * kChin];
    EXPECT_NEAR(std::hypot(chin[0], chin[1], chin[2]), 1, 1e-3) << "half of 2 cm off the mean";
    EXPECT_NEAR(off[f][0], 0, 1e-4) << "and nothing else moves";
  }
  EXPECT_NEAR(off[0][3 * kChin + 1], -off[1][3 * kChin + 1], 1e-3);
}

TEST(FaceDisplacements, PointsThatWereNotFound_SayNothing) {
  std::vector<Keypoints3d> faces = talking_head(0.02);
  faces[1].row(kChin).setZero();
  faces[3].setZero();
  faces[5].row(kChin).head<3>().array() += 1;  // a gross outlier
  const auto off = face_displacements(faces);
  EXPECT_THAT((std::vector<float>(&off[1][3 * kChin], &off[1][3 * kChin] + 3)),
              ElementsAre(0, 0, 0));
  EXPECT_THAT(off[3], Each(0));
  for (const float number : off[5]) {
    EXPECT_LE(std::abs(number), 3);
  }
  EXPECT_TRUE(face_displacements({}).empty());
}

TEST(FaceKeypoints, NamesOfASchema_SayWhichAreOfTheFace) {
  EXPECT_THAT(face_keypoints({"nose", "face_0", "left_hip", "face_1"}), ElementsAre(1, 3));
  EXPECT_TRUE(face_keypoints({"nose", "left_eye"}).empty());
}

}  // namespace
}  // namespace atelier

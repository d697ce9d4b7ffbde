// Archives of ground truth: what is written reads back, what does not fit together is refused.

#include "core/io/ground_truth_archive.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/core_io/few_cameras.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

GroundTruth small_truth() {
  GroundTruth truth;
  truth.cameras = fixtures::few_cameras(2);
  truth.skeleton.names = {"pelvis", "head"};
  truth.skeleton.parents = {-1, 0};
  truth.skeleton.offsets = Points::Constant(2, 3, 0.5);
  truth.body.vertices = Points::Random(4, 3);
  truth.body.faces.resize(2, 3);
  truth.body.faces << 0, 1, 2, 0, 2, 3;
  truth.shape_names = {"stature"};
  truth.shape = Eigen::VectorXd::Constant(1, 1.7);
  truth.keypoint_names = {"nose"};
  GroundTruthGarment garment;
  garment.garment.name = "dress";
  garment.garment.mesh = truth.body;
  garment.garment.rest = Points2::Random(6, 2);
  garment.garment.rest_faces = truth.body.faces;
  garment.seams = {{"side", {0, 1}, {4, 5}}};
  garment.label = Label::Dress;
  truth.garments = {garment};
  truth.lights = {AreaLight{}};
  truth.numbers = {{"seed", 7}};
  truth.texts = {{"motion", "spin"}};
  return truth;
}

TEST(GroundTruthArchive, WrittenArchive_ReadsBackEqual) {
  const GroundTruth truth = small_truth();
  const GroundTruth back = truth_of(archive_of(truth));
  EXPECT_EQ(back.cameras.size(), 2U);
  EXPECT_EQ(back.cameras[1].gain, truth.cameras[1].gain);
  EXPECT_EQ(back.skeleton.names, truth.skeleton.names);
  EXPECT_EQ(back.body.vertices, truth.body.vertices);
  EXPECT_EQ(back.shape, truth.shape);
  ASSERT_EQ(back.garments.size(), 1U);
  EXPECT_EQ(back.garments[0].label, Label::Dress);
  EXPECT_EQ(back.garments[0].garment.rest, truth.garments[0].garment.rest);
  EXPECT_EQ(back.garments[0].seams[0].b, truth.garments[0].seams[0].b);
  EXPECT_EQ(back.garments[0].garment.material.bending, truth.garments[0].garment.material.bending);
  EXPECT_EQ(back.lights.size(), 1U);
  EXPECT_EQ(back.numbers.at("seed"), 7);
  EXPECT_EQ(back.texts.at("motion"), "spin");

  GroundTruthFrame frame;
  frame.frame_id = 12;
  frame.joints = Points::Random(2, 3);
  frame.pose.rotations = Points::Random(2, 3);
  frame.keypoints = Points::Random(1, 3);
  frame.body = Points::Random(4, 3);
  frame.garments = {Points::Random(4, 3)};
  frame.body_seen = ByteImage(4, 2, 1, 1);
  frame.garments_seen = {ByteImage(4, 2, 1, 0)};
  const GroundTruthFrame again = ground_truth_frame_of(archive_of(frame, truth), truth);
  EXPECT_EQ(again.frame_id, 12);
  EXPECT_EQ(again.joints, frame.joints);
  EXPECT_EQ(again.pose.rotations, frame.pose.rotations);
  EXPECT_EQ(again.garments[0], frame.garments[0]);
  EXPECT_EQ(again.body_seen.data, frame.body_seen.data);
}

TEST(GroundTruthArchive, MismatchedArchive_IsRefused) {
  const GroundTruth truth = small_truth();
  Archive broken = archive_of(truth);
  broken.texts.erase("cameras");
  ATELIER_EXPECT_REFUSED(truth_of(broken), DataError, "cameras");
  broken = archive_of(truth);
  broken.datasets["garments/dress/pattern/seams"] = tensor_of(std::vector<int>{0, 0, 99}, {1, 3});
  ATELIER_EXPECT_REFUSED(truth_of(broken), DataError, "seams");
  broken = archive_of(truth);
  broken.datasets["garments/dress/material/values"] = tensor_of(std::vector<double>{1, 2});
  ATELIER_EXPECT_REFUSED(truth_of(broken), DataError, "8 numbers");
  broken = archive_of(truth);
  broken.datasets["skeleton/parents"] = tensor_of(std::vector<int>{-1, 5});
  EXPECT_THROW(truth_of(broken), DataError);
  GroundTruthFrame frame;
  frame.keypoints = Points::Random(1, 3);
  frame.body = Points::Random(4, 3);
  frame.garments = {Points(0, 3)};
  Archive other = archive_of(frame, truth);
  other.datasets["body"] = tensor_of(Points(Points::Random(9, 3)));
  ATELIER_EXPECT_REFUSED(ground_truth_frame_of(other, truth), DataError, "9 rows");
  other = archive_of(frame, truth);
  other.numbers["frame_id"] = -3;
  ATELIER_EXPECT_REFUSED(ground_truth_frame_of(other, truth), DataError, "frame_id");
}

}  // namespace
}  // namespace atelier

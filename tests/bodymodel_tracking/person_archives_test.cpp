// A person's body and tracked motion as files: they come back whole, and damaged ones are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_archive.h"
#include "bodymodel/formats/personal_body.h"
#include "bodymodel/formats/tracked_motion.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "core/error.h"
#include "core/io/npz.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

const BodyModel& body() {
  static const BodyModel model = [] {
    DefaultHumanOptions options;
    options.shape_basis = false;
    options.correctives = false;
    BodyModel plain = default_human(options);
    ShapeParameter taller{"taller", "m", 1.7, 1.5, 1.9, {{0, 1}, Points::Constant(2, 3, 0.5)}, {}};
    taller.joints = Points::Zero(joint_count(plain), 3);
    plain.shape = {taller};
    return plain;
  }();
  return model;
}

TrackedMotion three_frames() {
  TrackedMotion tracked;
  tracked.skeleton = body().skeleton;
  tracked.motion.fps = 12;
  tracked.motion.frame_ids = {3, 5, 6};
  const Index joints = joint_count(body());
  for (int f = 0; f < 3; ++f) {
    Pose pose = rest_pose(tracked.skeleton);
    pose.root_translation = {0.1 * f, 0, 1};
    pose.rotations(4, 0) = 0.2 * f;
    tracked.joints.push_back(forward_kinematics(tracked.skeleton, pose).positions);
    tracked.motion.poses.push_back(pose);
  }
  tracked.deviations = RowMatrix::Constant(3, joints, 0.004);
  tracked.trusted = {1, 0, 1};
  tracked.keypoint_rms = Eigen::Vector3d(0.01, 0.02, 0.03);
  tracked.scan_rms = Eigen::Vector3d(0.004, 0, 0.005);
  tracked.scan_share = Eigen::Vector3d(0.5, 0, 1);
  tracked.region = {2, 7, 9};
  return tracked;
}

TEST(PersonArchives, Person_RoundTrips) {
  TemporaryDirectory folder;
  Eigen::VectorXd shape = neutral_shape(body());
  shape[0] = 1.75;
  PersonalBody person = plain_person(body(), shape);
  EXPECT_TRUE(person.model.shape.empty());
  person.displacements(5, 1) = 0.01;
  person.model.mesh.vertices(5, 1) += 0.01;
  person.support[5] = 3;
  write_personal_body(folder.path() / "person.npz", person);
  const PersonalBody back = read_personal_body(folder.path() / "person.npz");
  EXPECT_EQ(back.shape_names, person.shape_names);
  EXPECT_EQ(back.shape, person.shape);
  EXPECT_EQ(back.displacements, person.displacements);
  EXPECT_EQ(back.support, person.support);
  EXPECT_EQ(back.model.mesh.vertices, person.model.mesh.vertices);
  EXPECT_EQ(back.model.skeleton.offsets, person.model.skeleton.offsets);
  // Every other command reads it as a body.
  EXPECT_EQ(read_body(folder.path() / "person.npz").mesh.vertices, person.model.mesh.vertices);
}

TEST(PersonArchives, Body_IsReadAsAPlainPerson) {
  TemporaryDirectory folder;
  write_body(folder.path() / "body.npz", body());
  const PersonalBody person = read_personal_body(folder.path() / "body.npz");
  EXPECT_EQ(person.model.mesh.vertices, body().mesh.vertices);
  EXPECT_EQ(person.shape, neutral_shape(body()));
  EXPECT_EQ(person.displacements.cwiseAbs().maxCoeff(), 0);
}

TEST(PersonArchives, PersonOfWrongSizes_IsRefused) {
  TemporaryDirectory folder;
  const auto path = folder.path() / "person.npz";
  const auto with = [&](const std::string& name, const Tensor& tensor) {
    const PersonalBody person = plain_person(body());
    auto arrays = body_arrays(person.model);
    arrays["person_shape_names"] = Tensor{ElementType::Text, {0}, {}, {}};
    arrays["person_shape"] = tensor_of(std::vector<double>{});
    arrays["person_displacements"] = tensor_of(RowMatrix(person.displacements));
    arrays["person_support"] =
        tensor_of(std::vector<double>(static_cast<std::size_t>(person.support.size()), 0.0));
    arrays[name] = tensor;
    write_npz(path, arrays, false);
    return refusal([&] { read_personal_body(path); });
  };
  EXPECT_THAT(with("person_shape", tensor_of(std::vector<double>{1, 2})), HasSubstr("2 values"));
  EXPECT_THAT(with("person_support", tensor_of(std::vector<double>{1, 2})),
              HasSubstr("one for each vertex"));
  EXPECT_THAT(with("person_displacements", tensor_of(std::vector<double>{1, 2, 3}, {1, 3})),
              HasSubstr("1 rows"));
  EXPECT_THAT(with("person_displacements", tensor_of(std::vector<double>{1, 2, 3, 4}, {1, 4})),
              HasSubstr("person_displacements"));
  EXPECT_THAT(with("person_support", tensor_of(std::vector<double>{NAN})),
              HasSubstr("person_support"));
  EXPECT_THAT(with("person_shape_names", tensor_of(std::vector<double>{1})),
              HasSubstr("a list of names"));
}

TEST(PersonArchives, ShapedModel_IsRefusedAsAPerson) {
  PersonalBody person = plain_person(body());
  person.model = body();
  EXPECT_THAT(refusal([&] { check_personal_body(person); }), HasSubstr("one shape"));
  EXPECT_THROW(plain_person(body(), Eigen::VectorXd::Zero(2)), LogicError);
}

TEST(PersonArchives, TrackedMotion_RoundTrips) {
  TemporaryDirectory folder;
  const TrackedMotion tracked = three_frames();
  write_tracked_motion(folder.path() / "tracked.h5", tracked);
  const TrackedMotion back = read_tracked_motion(folder.path() / "tracked.h5");
  EXPECT_EQ(back.skeleton.names, tracked.skeleton.names);
  EXPECT_EQ(back.skeleton.offsets, tracked.skeleton.offsets);
  EXPECT_EQ(back.motion.frame_ids, tracked.motion.frame_ids);
  EXPECT_EQ(back.motion.poses[1].rotations, tracked.motion.poses[1].rotations);
  EXPECT_EQ(back.motion.poses[1].root_translation, tracked.motion.poses[1].root_translation);
  EXPECT_EQ(back.joints[2], tracked.joints[2]);
  EXPECT_EQ(back.deviations, tracked.deviations);
  EXPECT_EQ(back.trusted, tracked.trusted);
  EXPECT_EQ(back.scan_share, tracked.scan_share);
  EXPECT_EQ(back.region, tracked.region);
}

TEST(PersonArchives, MalformedTrackedMotion_IsRefused) {
  const auto with = [](const std::function<void(Archive&)>& change) {
    Archive archive = archive_of(three_frames());
    change(archive);
    return refusal([&] { tracked_motion_of(archive, "x.h5"); });
  };
  EXPECT_THAT(with([](Archive& a) { a.datasets.erase("rotations"); }), HasSubstr("rotations"));
  EXPECT_THAT(with([](Archive& a) { a.datasets.erase("joint_names"); }),
              HasSubstr("no such dataset"));
  EXPECT_THAT(with([](Archive& a) { a.numbers.clear(); }), HasSubstr("fps"));
  EXPECT_THAT(with([](Archive& a) { a.numbers["fps"] = 0; }), HasSubstr("no rate"));
  EXPECT_THAT(with([](Archive& a) {
                a.datasets["frame_ids"] = tensor_of(std::vector<int>{5, 5, 6});
              }),
              HasSubstr("out of order"));
  EXPECT_THAT(with([](Archive& a) {
                a.datasets["frame_ids"] = tensor_of(std::vector<int>{-5, 5, 6});
              }),
              HasSubstr("-5"));
  EXPECT_THAT(with([](Archive& a) { a.datasets["trusted"] = tensor_of(std::vector<double>{1}); }),
              HasSubstr("1 values"));
  EXPECT_THAT(with([](Archive& a) {
                a.datasets["scan_rms"] = tensor_of(std::vector<double>{1, NAN, 2});
              }),
              HasSubstr("scan_rms"));
  EXPECT_THAT(with([](Archive& a) {
                a.datasets["region"] = tensor_of(std::vector<int>{4, 3});
              }),
              HasSubstr("region"));
  EXPECT_THAT(with([](Archive& a) {
                a.datasets["parents"] = tensor_of(std::vector<int>{-1, 0});
              }),
              HasSubstr("x.h5"));
  TrackedMotion negative = three_frames();
  negative.deviations(1, 1) = -1;
  EXPECT_THAT(refusal([&] { check_tracked_motion(negative); }), HasSubstr("deviations"));
}

}  // namespace
}  // namespace atelier::fixtures

#include <algorithm>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/personal_body.h"
#include "bodymodel/human/default_human.h"
#include "bodymodel/kinematics.h"
#include "bodymodel/skinning.h"
#include "bodymodel/surface_frames.h"
#include "core/error.h"
#include "core/label.h"
#include "core/normals.h"
#include "core/usage_error.h"
#include "pipeline/avatar/avatar_input.h"
#include "pipeline/avatar/avatar_result.h"
#include "pipeline/avatar/avatar_stage.h"
#include "pipeline/avatar/surface_faults.h"
#include "tests/support/refusals.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

/// A person, and the same with everything 2 cm farther out.
struct Inflated {
  PersonalBody person = plain_person(default_human(female_human()));
  fixtures::TemporaryDirectory folder;

  Inflated() {
    PersonalBody seen = person;
    Mesh& mesh = seen.model.mesh;
    mesh.vertices += 0.02 * vertex_normals(mesh.vertices, mesh.faces);
    write_personal_body(folder / "avatar.npz", seen);
  }
};

TEST(BodyAvatar, DisplacementOfTheRestPose_FollowsTheBody) {
  const Inflated inflated;
  const BodyModel& model = inflated.person.model;
  const BodyAvatar avatar = read_body_avatar(inflated.folder.path(), model);
  Pose pose = rest_pose(model.skeleton);
  pose.rotations.row(1) << 0, 0, 0.5;
  pose.root_translation << 1, 0, 2;
  const Points body = skin_vertices(model, pose);
  const Points seen = seen_surface(avatar, body);
  const Points normals = vertex_normals(body, model.mesh.faces);
  const Eigen::VectorXd along = (seen - body).cwiseProduct(normals).rowwise().sum();
  EXPECT_NEAR(along.mean(), 0.02, 5e-4);
  EXPECT_LT((seen - body).rowwise().norm().maxCoeff(), 0.0201);
  const std::vector<char> over = over_clothes(avatar);
  EXPECT_EQ(std::count(over.begin(), over.end(), 1), body.rows());
}

TEST(BodyAvatar, AnotherPerson_IsRefused) {
  const Inflated inflated;
  BodyModel other = inflated.person.model;
  other.mesh.faces.conservativeResize(other.mesh.faces.rows() - 1, 3);
  ATELIER_EXPECT_REFUSED(read_body_avatar(inflated.folder.path(), other), DataError,
                         "run 'atelier avatar' again");
}

TEST(BodyAvatar, AnotherPersonOfTheSameTopology_IsRefused) {
  const Inflated inflated;
  const BodyModel tall =
      at_shape(default_human(female_human()),
               neutral_shape(default_human(female_human())) +
                   0.1 * Eigen::VectorXd::Unit(
                             static_cast<Index>(default_human(female_human()).shape.size()),
                             find_shape(default_human(female_human()), "stature")));
  ATELIER_EXPECT_REFUSED(read_body_avatar(inflated.folder.path(), plain_person(tall).model),
                         DataError, "other bones");
}

TEST(SurfaceFaults, SurfaceThatFollowsTheBody_HasNone) {
  const Inflated inflated;
  const BodyModel& model = inflated.person.model;
  const BodyAvatar avatar = read_body_avatar(inflated.folder.path(), model);
  Pose pose = rest_pose(model.skeleton);
  pose.root_translation << 1, 0, 2;
  pose.rotations.row(0) << 0.3, 2, 0;
  const Points body = skin_vertices(model, pose);
  const Triangles& faces = model.mesh.faces;
  const Points& rest = model.mesh.vertices;
  const SurfaceFaults faults =
      surface_faults(faces, rest, avatar.rest.vertices, body, seen_surface(avatar, body));
  EXPECT_EQ(faults.inverted, 0);
  EXPECT_LT(faults.stretch, 1.001);
}

TEST(SurfaceFaults, VertexOutOfItsPlace_TurnsFacesAndStretchesEdges) {
  const Inflated inflated;
  const BodyModel& model = inflated.person.model;
  const Triangles& faces = model.mesh.faces;
  const Points& rest = model.mesh.vertices;
  Points torn = rest;
  const int corner = faces(100, 0);
  const Eigen::RowVector3d opposite = (rest.row(faces(100, 1)) + rest.row(faces(100, 2))) / 2;
  torn.row(corner) += 3 * (opposite - rest.row(corner));  // through the other side and beyond it
  const SurfaceFaults faults = surface_faults(faces, rest, rest, rest, torn);
  EXPECT_GE(faults.inverted, 1);
  EXPECT_GT(faults.stretch, 1.5);
  const SurfaceFaults at_rest = surface_faults(faces, rest, torn, rest, torn);
  EXPECT_EQ(at_rest.inverted, 0);
  EXPECT_NEAR(at_rest.stretch, 1, 1e-12);
}

TEST(BodyAvatar, NoFile_IsRefused) {
  const fixtures::TemporaryDirectory folder;
  EXPECT_ANY_THROW(
      read_body_avatar(folder.path(), plain_person(default_human(female_human())).model));
}

TEST(BodyLabels, MinimallyClothedPerson_IsAllBody) {
  ByteImage labels(5, 1, 1);
  labels.data = {0, 1, 2, 3, 8};  // background, skin, hair, upper, other
  EXPECT_THAT(body_labels(labels, true).data, ::testing::ElementsAre(0, 1, 1, 1, 8));
  EXPECT_THAT(body_labels(labels, false).data, ::testing::ElementsAre(0, 1, 1, 3, 8));
  EXPECT_TRUE(body_labels({}, true).data.empty());
}

TEST(AvatarStage, Settings_SayTheTexture) {
  AvatarStageOptions options;
  const TrainOptions small = avatar_training(options, Device::Cpu);
  EXPECT_EQ(small.resolution, 512);
  EXPECT_EQ(small.shading, 4) << "branches of 128 texels, as garments have";
  options.train.setting = TrainSetting::Full;
  EXPECT_EQ(avatar_training(options, Device::Cpu).resolution, 2048);
  options.train.resolution = 64;
  options.train.shading = 2;
  EXPECT_EQ(avatar_training(options, Device::Cpu).resolution, 64);
  options.train.resolution = 100;
  ATELIER_EXPECT_REFUSED(avatar_training(options, Device::Cpu), UsageError, "100");
}

}  // namespace
}  // namespace atelier

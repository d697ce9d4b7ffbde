#include "bodymodel/formats/body_size.h"

#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodymodel/formats/body_file.h"
#include "bodymodel/formats/gltf_body.h"
#include "bodymodel/skinning.h"
#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"
#include "tests/bodymodel/synthetic_person.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/test_data.h"

namespace atelier {
namespace {

using fixtures::person_body;
using fixtures::person_skeleton;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(BodySize, ScaledBody_MovesAsTheBody) {
  const BodyModel model = fixtures::synthetic_body();
  const BodyModel large = scaled_body(model, 100);
  Pose pose = fixtures::random_pose(model.skeleton, 3);
  Eigen::VectorXd shape = neutral_shape(model);
  shape[0] += 0.1;  // in metres
  shape[1] += 0.2;  // a share
  const Points small = skin_vertices(model, pose, shape);
  pose.root_translation *= 100;
  shape[0] *= 100;
  EXPECT_EQ(large.shape[0].unit, "m");
  EXPECT_LT((skin_vertices(large, pose, shape) - 100 * small).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_THROW(scaled_body(model, 0), LogicError);
  EXPECT_THROW(scaled_body(model, std::nan("")), LogicError);
}

TEST(BodySize, PeopleInOtherUnits_AreRefusedWithTheFactor) {
  const BodyModel person = person_body(person_skeleton());
  check_body_size(person, "p");
  const std::pair<double, const char*> units[] = {{100, "metres_per_unit = 0.01"},
                                                  {1000, "metres_per_unit = 0.001"},
                                                  {10, "metres_per_unit = 0.1"},
                                                  {1 / 0.0254, "metres_per_unit = 0.0254"},
                                                  {0.01, "metres_per_unit = 100"}};
  for (const auto& [factor, advice] : units) {
    const BodyModel other = scaled_body(person, factor);
    EXPECT_THAT([&] { check_body_size(other, "p.glb"); },
                ThrowsMessage<DataError>(
                    AllOf(HasSubstr("p.glb"), HasSubstr("0.3 to 3 m"), HasSubstr(advice))))
        << factor;
  }
  check_body_size(scaled_body(person, 0.4));  // a child
}

TEST(BodySize, PersonLyingAlongZ_IsRefused) {
  BodyModel model = person_body(person_skeleton());
  for (Points* points : {&model.mesh.vertices, &model.skeleton.offsets}) {
    const Eigen::VectorXd y = points->col(1);
    points->col(1) = -points->col(2);
    points->col(2) = y;
  }
  EXPECT_THAT([&] { check_body_size(model, "z.glb"); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("head lies along z"), HasSubstr("Y up"))));
}

TEST(BodySize, FileInCentimetres_IsReadOnceUnitIsGiven) {
  const fixtures::TemporaryDirectory folder;
  const std::filesystem::path path = folder / "cm.glb";
  const BodyModel person = person_body(person_skeleton());
  write_gltf(path, gltf_body(scaled_body(person, 100)));
  EXPECT_THAT([&] { read_body_file(path); },
              ThrowsMessage<DataError>(HasSubstr("set metres_per_unit = 0.01")));
  BodyFileOptions options;
  options.metres_per_unit = 0.01;
  const BodyModel back = read_body_file(path, options).model;
  EXPECT_LT((back.mesh.vertices - person.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((back.skeleton.offsets - person.skeleton.offsets).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(BodySize, FoxInCentimetres_IsRefusedUntilUnitIsGiven) {
  ATELIER_TEST_FILE(path, "gltf_skinned/bevy_fox/Fox.glb");
  EXPECT_THAT([&] { read_body_file(path); },
              ThrowsMessage<DataError>(
                  AllOf(HasSubstr("m long"), HasSubstr("set metres_per_unit = 0.01"))));
  BodyFileOptions options;
  options.metres_per_unit = 0.01;
  const BodyModel fox = read_body_file(path, options).model;
  EXPECT_NEAR(fox.mesh.vertices.col(1).maxCoeff(), 0.79, 0.02);
}

}  // namespace
}  // namespace atelier

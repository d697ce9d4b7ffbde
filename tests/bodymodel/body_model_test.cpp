#include "bodymodel/body_model.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/bodymodel/synthetic_body.h"

namespace atelier {
namespace {

using fixtures::synthetic_body;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(BodyModel, CompleteModel_IsAccepted) {
  EXPECT_NO_THROW(check_body_model(synthetic_body()));
  EXPECT_EQ(joint_count(synthetic_body()), 7);
  EXPECT_EQ(vertex_count(synthetic_body()), 40);
}

TEST(BodyModel, ShapesAndGroups_AreFoundByName) {
  const BodyModel model = synthetic_body();
  EXPECT_EQ(find_shape(model, "belly"), 1);
  EXPECT_EQ(find_shape(model, "wings"), -1);
  EXPECT_EQ(neutral_shape(model), Eigen::Vector2d(1.7, 0));
}

// One damage of a model and what the refusal must say.
struct Damage {
  const char* name;
  void (*spoil)(BodyModel&);
  const char* where;
  const char* expected;
};

class BodyModelRefusal : public ::testing::TestWithParam<Damage> {};

TEST_P(BodyModelRefusal, SpoiledModel_IsRefusedWithPlaceAndRule) {
  BodyModel model = synthetic_body();
  GetParam().spoil(model);
  EXPECT_THAT([&] { check_body_model(model, "person.npz"); },
              ThrowsMessage<DataError>(AllOf(HasSubstr("person.npz"), HasSubstr(GetParam().where),
                                             HasSubstr(GetParam().expected))));
}

const Damage kDamages[] = {
    {"WeightsNotOne", [](BodyModel& m) { m.skin.weights(5, 1) += 0.1; }, "skin weights of vertex 5",
     "a sum of 1"},
    {"NegativeWeight", [](BodyModel& m) { m.skin.weights(4, 2) = -0.1; },
     "skin weights of vertex 4", "not negative"},
    {"NanWeight", [](BodyModel& m) { m.skin.weights(3, 0) = NAN; }, "skin weights of vertex 3",
     "finite weight"},
    {"JointOutOfRange", [](BodyModel& m) { m.skin.joints(2, 3) = 7; }, "skin weights of vertex 2",
     "a joint in [0, 7)"},
    {"WeightRowsMissing", [](BodyModel& m) { m.skin.weights.conservativeResize(39, 4); },
     "40 rows of joints and 39 of weights", "one for each vertex"},
    {"SlotsDiffer", [](BodyModel& m) { m.skin.weights.conservativeResize(40, 3); },
     "4 joints and 3 weights", "as many of both"},
    {"NoSlots",
     [](BodyModel& m) {
       m.skin.weights.resize(40, 0);
       m.skin.joints.resize(40, 0);
     },
     "0 joints", "at least one"},
    {"Cycle", [](BodyModel& m) { m.skeleton.parents = {-1, 2, 1, 1, 3, 1, 0}; }, "joint 1 'spine'",
     "a parent before its child (no cycles)"},
    {"TwoRoots", [](BodyModel& m) { m.skeleton.parents[3] = -1; }, "a second root", "one root"},
    {"NoJoints", [](BodyModel& m) { m.skeleton = {}; }, "skeleton", "at least one"},
    {"RepeatedJointName", [](BodyModel& m) { m.skeleton.names[4] = "head"; }, "joint 4",
     "a unique name"},
    {"NanOffset", [](BodyModel& m) { m.skeleton.offsets(2, 1) = NAN; }, "offsets", "finite"},
    {"NanVertex", [](BodyModel& m) { m.mesh.vertices(9, 2) = INFINITY; }, "vertex 9", "finite"},
    {"FaceOutOfRange", [](BodyModel& m) { m.mesh.faces(3, 1) = 40; }, "face 3", "0 to 39"},
    {"ShapeRowsMissing", [](BodyModel& m) { m.shape[0].surface.offsets.conservativeResize(39, 3); },
     "shape parameter stature", "40, one for each vertex"},
    {"ShapeJointsMissing", [](BodyModel& m) { m.shape[0].joints.conservativeResize(6, 3); },
     "6 joint offsets", "7 finite ones"},
    {"ShapeNameTwice", [](BodyModel& m) { m.shape[1].name = "stature"; },
     "an empty or repeated name", "a name of its own"},
    {"RangeWithoutNeutral", [](BodyModel& m) { m.shape[0].neutral = 3; }, "neutral 3 in range 1.5",
     "a finite range that holds the neutral value"},
    {"RangeReversed", [](BodyModel& m) { std::swap(m.shape[1].min, m.shape[1].max); },
     "shape parameter belly", "a finite range"},
    {"SparseNotIncreasing",
     [](BodyModel& m) {
       m.shape[1].surface.vertices = {1, 4, 3, 17};
     },
     "vertex 3", "increasing indices below 40"},
    {"SparseOutOfRange", [](BodyModel& m) { m.shape[1].surface.vertices[3] = 40; }, "vertex 40",
     "below 40"},
    {"NanDirection", [](BodyModel& m) { m.shape[1].surface.offsets(0, 0) = NAN; },
     "shape parameter belly", "finite metres"},
    {"CorrectiveJoint", [](BodyModel& m) { m.correctives[2].joint = -1; }, "pose corrective 2",
     "a joint in [0, 7)"},
    {"CorrectiveComponent", [](BodyModel& m) { m.correctives[10].component = 4; },
     "pose corrective 10", "a component below 4"},
    {"BendAxisNotUnit", [](BodyModel& m) { m.correctives.back().axis *= 2; }, "an axis of length 2",
     "unit length"},
    {"RegressorRows", [](BodyModel& m) { m.regressor.resize(3); }, "joint regressor: 3 rows",
     "7, one for each joint"},
    {"RegressorVertex",
     [](BodyModel& m) {
       m.regressor.resize(7);
       m.regressor[6] = {{40}, {1}};
     },
     "joint regressor row 6", "below 40"},
    {"RegressorSizes",
     [](BodyModel& m) {
       m.regressor.resize(7);
       m.regressor[1] = {{4, 5}, {1}};
     },
     "2 vertices and 1 weights", "as many of both"},
    {"GroupVertex", [](BodyModel& m) { m.groups[0].vertices.push_back(-1); }, "vertex group top",
     "a vertex in [0, 40)"},
    {"GroupNameTwice", [](BodyModel& m) { m.groups.push_back(m.groups[0]); }, "vertex group top",
     "a name of its own"},
};

INSTANTIATE_TEST_SUITE_P(Damages, BodyModelRefusal, ::testing::ValuesIn(kDamages),
                         [](const auto& damage) { return std::string(damage.param.name); });

}  // namespace
}  // namespace atelier
